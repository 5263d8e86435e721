"""The page of all settings, written from the configuration's own comments and the signatures."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import hydra
from hydra import initialize_config_dir
from omegaconf import DictConfig

from forestrl.cli import COMMANDS
from forestrl.config import CONF_DIR
from forestrl.help import Setting, about, settings

_PRESETS = ("experiment", "ablation")  # options that only change other groups' settings


def page() -> str:
    """Writes the commands with their own settings, then every option of every group."""
    parts, groups = [], {}
    for command, summary in COMMANDS.items():
        cfg = _composed(command)
        rows = [row for row in _rows(command, cfg) if row.name.split(".")[0] not in _chosen(cfg)]
        parts += [f"## `forestrl {command}`", f"To {summary}.", _table(rows)]
        groups |= {group: command for group in _chosen(cfg) if group not in groups}
    for group, command in groups.items():
        parts.append(f"## `{group}=`")
        parts += _presets(group) if group in _PRESETS else _options(group, command)
    return "\n\n".join(parts)


def _options(group: str, command: str) -> list[str]:
    """The options of a group; the settings of one that were listed before it are left out."""
    parts, listed = [], set()
    chosen = _composed(command).hydra.runtime.choices[group]
    for path in sorted(_files(group), key=lambda path: (path.stem != chosen, path.stem)):
        cfg = _composed(command, f"{group}={path.stem}")
        rows = [row for row in _rows(command, cfg) if row.name.split(".")[0] == group]
        new = [row for row in rows if row not in listed]
        parts += [f"### `{group}={path.stem}`", about(path)]
        if listed and len(new) < len(rows):
            parts.append("Otherwise as above.")
        parts += [_table(new)] if new else []
        listed |= set(rows)
    return parts


def _presets(group: str) -> list[str]:
    parts = []
    for path in _files(group):
        lines = path.read_text(encoding="utf-8").splitlines()
        text = "\n".join(line for line in lines if not line.startswith("# ")).strip()
        parts += [f"### `{group}={path.stem}`", about(path)]
        parts += [f"```yaml\n{text}\n```"] if text else []
    return parts


def _files(group: str) -> list[Path]:
    """The options that can be chosen; one that every other starts from is none."""
    return sorted(path for path in Path(CONF_DIR, group).glob("*.yaml") if path.stem != "base")


def _composed(command: str, *overrides: str) -> DictConfig:
    with initialize_config_dir(CONF_DIR, version_base="1.3"):
        return hydra.compose(command, list(overrides), return_hydra_config=True)


def _chosen(cfg: DictConfig) -> list[str]:
    return [group for group in cfg.hydra.runtime.choices if "/" not in group]


def _rows(command: str, cfg: DictConfig) -> list[Setting]:
    declared = import_module(f"forestrl.{command}").Settings
    return settings(cfg, declared, [Path(CONF_DIR)])


def _table(rows: list[Setting]) -> str:
    head = ["| setting | value | meaning | allowed |", "|---|---|---|---|"]
    cells = [
        [f"`{row.name}`", f"`{row.value}`", _escaped(row.meaning), _escaped(row.allowed)]
        for row in rows
    ]
    return "\n".join([*head, *(f"| {' | '.join(each)} |" for each in cells)])


def _escaped(text: str) -> str:
    """Keeps what Markdown would take for markup."""
    return "".join(f"\\{char}" if char in "|*<>_[]$" else char for char in text)


def _write(app: Any, name: str, source: list[str]) -> None:
    if name == "settings":
        source[0] = source[0].partition("<!-- generated -->")[0] + page()


def setup(app: Any) -> dict[str, bool]:
    """Writes the page as the site is built."""
    app.connect("source-read", _write)
    return {"parallel_read_safe": True}
