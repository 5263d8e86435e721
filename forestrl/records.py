"""What a run folder says of its run: how it began, with which settings it went on, how it ended."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from forestrl.settings import not_allowed
from forestrl.storage import atomic_write

MARK = ".hydra"
"""The folder in a run folder that Hydra keeps the configuration in, and we the rest."""
SWEEP_FILE = "multirun.yaml"
_CONFIG, _WORDS, _FINISHED = "config.yaml", "overrides.yaml", "finished.json"


def setting(word: str) -> str:
    """Gives the setting that a word of the command line sets.

    >>> setting("+env.n_trees=75")
    'env.n_trees'
    """
    return word.lstrip("+~").partition("=")[0]


def began_with(folder: Path) -> list[str]:
    """Gives the words that a run began and went on with; none if its folder keeps none."""
    path = folder / MARK / _WORDS
    return [str(word) for word in OmegaConf.load(path)] if path.is_file() else []


def resumed(
    cfg: DictConfig,
    folder: Path,
    words: list[str],
    choices: dict[str, str],
    why_not: Callable[[str], str | None],
) -> DictConfig:
    """Gives the configuration of a run that goes on, with what is asked for now.

    Args:
        cfg: what the command line gives by itself.
        folder: of the run.
        words: of the command line; what they say as before is no change.
        choices: the option that each group has now.
        why_not: why a setting cannot be changed on the way; None if it can.

    Returns:
        the configuration; :func:`record` keeps it.

    Raises:
        ValueError: if another value is asked for that cannot be had, or the folder's own
            configuration is damaged.
    """
    old = DictConfig(_loaded(folder / MARK / _CONFIG))
    hydra = _loaded(folder / MARK / "hydra.yaml")
    chosen = dict(OmegaConf.select(hydra, "hydra.runtime.choices") or {})
    chosen |= {setting(word): word.partition("=")[2] for word in began_with(folder)}
    names = {setting(word) for word in words} - {"resume"}
    for name in sorted(names, key=lambda name: (name.count("."), name)):
        value = OmegaConf.select(cfg, name)
        if name in choices:
            same = str(choices[name]) == str(chosen.get(name))
        else:
            same = value == OmegaConf.select(old, name)
        if same:
            continue
        reason = why_not(name)
        if name not in cfg and name in choices:
            reason = "it stands for several settings: give those that are to change one by one"
        if reason:
            raise not_allowed(name, choices.get(name, value), f"resume={folder} goes on: {reason}")
        OmegaConf.update(old, name, value, merge=False)
    return old


def record(cfg: DictConfig, folder: Path, words: list[str]) -> None:
    """Keeps the settings that a run goes on with where those that it began with stood."""
    atomic_write(folder / MARK / _CONFIG, OmegaConf.to_yaml(cfg))
    new = {setting(word): word for word in [*began_with(folder), *words]}
    new.pop("resume", None)
    atomic_write(folder / MARK / _WORDS, OmegaConf.to_yaml(OmegaConf.create([*new.values()])))


def _loaded(path: Path) -> Any:
    try:
        return OmegaConf.load(path)
    except (YAMLError, OmegaConfBaseException) as error:
        raise ValueError(f"{path} is damaged: {' '.join(str(error).split())}") from error


def finished(folder: Path) -> dict[str, Any] | None:
    """Gives what a finished run returned, as ``{"result": ...}``; None if it is not finished."""
    try:
        return dict(json.loads((folder / MARK / _FINISHED).read_text()))
    except (OSError, ValueError, TypeError):
        return None


def mark_finished(folder: Path, result: Any) -> None:
    """Notes that a run is finished; a sweep that is started again does not run it again."""
    if (folder / MARK).is_dir():
        number = result if isinstance(result, int | float) else None
        atomic_write(folder / MARK / _FINISHED, json.dumps({"result": number}) + "\n")


def unmark(folder: Path) -> None:
    """Takes the note back, as the run goes on."""
    (folder / MARK / _FINISHED).unlink(missing_ok=True)


def is_sweep(folder: Path) -> bool:
    """Tells whether a folder is that of a sweep."""
    return (folder / SWEEP_FILE).is_file()


def jobs(sweep: Path) -> list[Path]:
    """Gives the folders of a sweep's jobs that were begun, in their order."""
    folders = [path.parents[1] for path in sweep.rglob(f"{MARK}/hydra.yaml")]
    return sorted(folders, key=lambda path: (len(path.name), path.name))
