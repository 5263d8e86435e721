"""What ``--help`` says: meanings and units from comments in ``conf/``, ranges from signatures."""

from __future__ import annotations

import re
import shutil
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from omegaconf import DictConfig

from forestrl.config import followed, is_unread, kinds_of, leaves
from forestrl.settings import describe
from forestrl.wording import written

_KEY = re.compile(r"(\s*)([\w.]+):(?:.*?\s#\s+(.*))?")
_HIDDEN = ("_target_", "name")
_COLUMN = 34
_MORE = (
    "-m key=a,b: a sweep, a folder a job.  --cfg job: the configuration as YAML.  --config-dir: a "
    "folder with your own.  --hydra-help: the rest."
)


class Setting(NamedTuple):
    """A setting as a reader meets it.

    Attributes:
        name: with dots.
        value: as it is written on the command line; ``${other}`` where it follows another one.
        meaning: with its unit.
        allowed: its kind and range in words.
    """

    name: str
    value: str
    meaning: str
    allowed: str


def help_text(command: str, cfg: DictConfig, declared: Any) -> str:
    """Writes the help of a command, from its configuration with Hydra's own part."""
    sources = [
        Path(each.path) for each in cfg.hydra.runtime.config_sources if each.schema == "file"
    ]
    choices = {
        name: option for name, option in cfg.hydra.runtime.choices.items() if "/" not in name
    }
    rows = settings(cfg, declared, sources)
    own = [row for row in rows if row.name.split(".")[0] not in choices]
    lines = [f"usage: forestrl {command} [key=value ...]", "", *map(_line, own)]
    chosen = [group for group in choices if not is_unread(declared, group)]
    for group in sorted(chosen, key=[*cfg, *choices].index):
        lines += ["", _options(group, choices[group], sources)]
        lines += [_line(row) for row in rows if row.name.split(".")[0] == group]
    return "\n".join([*lines, "", _wrapped(_MORE)])


def settings(cfg: DictConfig, declared: Any, sources: list[Path]) -> list[Setting]:
    """Lists a command's settings, its own ones first; not those that only follow another one.

    Args:
        cfg: its whole configuration.
        declared: what it says of its own settings.
        sources: the folders that the configuration was composed from.
    """
    kinds, choices = kinds_of(cfg, declared), cfg.hydra.runtime.choices
    own = _comments([source / f"{cfg.hydra.job.config_name}.yaml" for source in sources])
    meanings = _comments(path for source in sources for path in source.glob("*.yaml")) | own
    for group, option in choices.items():
        paths = [path for source in sources for path in source.glob(f"{group}/*.yaml")]
        chosen = [path for path in paths if path.stem == option]  # its own words hold
        texts = _comments(paths) | _comments(chosen)
        meanings |= {f"{group}.{name}": text for name, text in texts.items()}
    values = leaves(cfg)
    names = [
        name
        for name, value in values.items()
        if not {*_HIDDEN} & {*name.split(".")}
        and not is_unread(declared, name)
        and (name in meanings or not followed(value))
    ]
    names.sort(key=lambda name: name not in own)
    return [
        Setting(name, written(values[name]), meanings.get(name, ""), describe(kinds.get(name)))
        for name in names
    ]


def _comments(paths: Iterable[Path]) -> dict[str, str]:
    """Collects the comments behind the keys of YAML files, by the keys' dotted names."""
    found: dict[str, str] = {}
    for path in paths:
        above: list[tuple[int, str]] = []  # the keys that hold the line's, with their indentation
        for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
            if match := _KEY.match(line):
                depth, key, comment = len(match[1]), match[2], match[3]
                above = [(indent, name) for indent, name in above if indent < depth]
                above.append((depth, key))
                if comment:
                    found[".".join(name for _, name in above)] = comment
    return found


def about(path: Path) -> str:
    """Gives the words at the head of a YAML file, which say what it is."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return " ".join(line[2:] for line in lines if line.startswith("# ") and "@" not in line)


def _options(group: str, chosen: str | None, sources: list[Path]) -> str:
    """Writes a group with its options, and what the chosen one is."""
    paths = {path.stem: path for source in sources for path in source.glob(f"{group}/*.yaml")}
    others = ", ".join(sorted(paths.keys() - {chosen}))
    head = about(paths[chosen]) if chosen in paths else ""
    words = f"{head} {f'Others: {others}.' if others else ''}"
    return _wrapped(f"{group}={written(chosen)}".ljust(_COLUMN) + " " + words, _COLUMN + 1)


def _line(row: Setting) -> str:
    words = f"{row.meaning} [{row.allowed}]" if row.allowed else row.meaning
    return _wrapped(f"  {row.name}={row.value}".ljust(_COLUMN) + " " + words, _COLUMN + 1)


def _wrapped(text: str, indent: int = 0) -> str:
    width = min(shutil.get_terminal_size().columns, 120)
    lines = textwrap.wrap(
        text, width, subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False
    )
    return "\n".join(lines)
