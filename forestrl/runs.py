"""A run has a folder of its own: claimed before anything is written, left if nothing was.

Hydra calls :class:`OwnFolder` with the configuration that it has composed. A folder is claimed with
a lock that the system gives back when the process ends, however it ends.
"""

from __future__ import annotations

import fcntl
import os
import shutil
from contextlib import suppress
from itertools import chain, count
from pathlib import Path
from typing import Any

from hydra.core.override_parser.types import Quote, QuotedString
from hydra.experimental.callback import Callback
from omegaconf import DictConfig, OmegaConf, read_write
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from forestrl.records import MARK, SWEEP_FILE
from forestrl.storage import clear_parts, is_part

_LOCK = "lock"
_OF_NO_WORTH = (MARK, SWEEP_FILE)
_TRAININGS = Path("outputs/train")
_CLOCK = "${now:"  # in the name of a folder that may as well have another name

_claimed: dict[Path, tuple[int, list[Path]]] = {}
"""This process's folders: the lock's file, and the folders made for it, the outermost last."""
_sweeps: list[Path] = []
"""The folder of the sweep that this process runs, if it does."""


class Refusal(BaseException):
    """Carries an error past Hydra, which would only warn of what a callback raises."""


class OwnFolder(Callback):
    """Gives each run and each sweep a folder of its own."""

    def on_run_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Claims ``hydra.run.dir``; a run that goes on has the folder where it began."""
        resume = config.get("resume")
        try:
            if resume is None:
                folder = _claim(config, "run")
            else:
                folder = take_up(Path(str(resume)), config.hydra.job.name)
        except (OSError, ValueError) as error:
            raise Refusal from error
        with read_write(config.hydra):
            config.hydra.run.dir = str(folder)
            if resume is not None:
                config.hydra.output_subdir = None  # the configuration it began with stays

    def on_multirun_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Claims ``hydra.sweep.dir``, for all jobs."""
        try:
            folder = str(_claim(config, "sweep"))
        except (OSError, ValueError) as error:
            raise Refusal from error
        _sweeps.append(Path(folder))
        with read_write(config.hydra):
            config.hydra.sweep.dir = folder
            config.hydra.overrides.hydra.append(f"hydra.sweep.dir={quoted(folder)}")


def latest_training() -> Path:
    """Finds the run folder under ``outputs/train`` whose policy is the newest.

    Raises:
        FileNotFoundError: if there is none.
    """
    policies = _TRAININGS.glob("*/checkpoints/*/policy.safetensors")
    newest = max(policies, key=lambda path: path.stat().st_mtime, default=None)
    if newest is None:
        raise FileNotFoundError(f"checkpoint=latest: no training under {_TRAININGS} has a policy")
    return newest.parents[2]


def quoted(text: str) -> str:
    """Writes a text so that Hydra reads it as it is, whatever is in it."""
    return QuotedString(text, Quote.double).with_quotes()


def _claim(config: DictConfig, kind: str) -> Path:
    """Claims the folder of a run or sweep; one named after the time gets a number if it must."""
    folder = Path(str(config.hydra[kind].dir))
    if _CLOCK in str(OmegaConf.to_container(config.hydra[kind], resolve=False)):
        numbered = (folder.with_name(f"{folder.name}-{number}") for number in count(2))
        return next(path for path in chain([folder], numbered) if _obstacle(path) is None)
    if kind == "sweep" and _began_as(folder, config):
        return take(folder)
    if (obstacle := _obstacle(folder)) is not None:
        more = (
            f", or go on with it: resume={folder}" if kind == "run" and "resume" in config else ""
        )
        raise ValueError(
            f"hydra.{kind}.dir={folder} is not allowed: {obstacle}; take another folder, or move "
            f"this one away{more}"
        )
    return folder


def _obstacle(folder: Path) -> str | None:
    """Says why a folder cannot be had; None if it could, and now is this process's."""
    if not _lock(folder):
        return "another run is writing into it"
    ran = (folder / MARK / "config.yaml").exists() or any(folder.glob(f"*/{MARK}"))
    if ran and _worth(folder):
        _leave(folder)
        return "it holds a run already"
    if ran:
        clear_parts(folder)
    return None


def _began_as(folder: Path, config: DictConfig) -> bool:
    """Tells whether the sweep that began in a folder is this one, which then goes on there."""
    try:
        began: Any = OmegaConf.load(folder / SWEEP_FILE)
        return _asked(began) == _asked(config)
    except (OSError, ValueError, AttributeError, YAMLError, OmegaConfBaseException):
        return False


def _asked(config: DictConfig) -> tuple[Any, ...]:
    """What tells one sweep from another."""
    settings: Any = OmegaConf.to_container(config, resolve=False)
    hydra = settings.pop("hydra")
    return settings, hydra["job"]["name"], hydra["overrides"]["task"], hydra["sweeper"]["params"]


def take_up(folder: Path, command: str) -> Path:
    """Claims the folder of an earlier run, to go on with it; returns the folder.

    Raises:
        FileNotFoundError: if no run of this command began there.
        ValueError: if another process has it.
    """
    path = folder / MARK / "hydra.yaml"
    if not path.is_file():
        raise FileNotFoundError(f"resume={folder} is not a run folder: {path} does not exist")
    began_as = OmegaConf.select(OmegaConf.load(path), "hydra.job.name")
    if began_as != command:
        raise ValueError(f"resume={folder} is a run of forestrl {began_as}, not of {command}")
    return take(folder, f"resume={folder} is not allowed: ")


def take(folder: Path, refusal: str = "") -> Path:
    """Claims a folder that may hold a run, and clears what a killed one left half written.

    Raises:
        ValueError: if another process has it.
    """
    if not _lock(folder):
        raise ValueError(f"{refusal or f'{folder}: '}another run is writing into it")
    clear_parts(folder)
    return folder


def sweep_folder() -> Path | None:
    """Gives the folder of the sweep that this process runs, if it does."""
    return _sweeps[-1] if _sweeps else None


def has_worth(folder: Path) -> bool:
    """Tells whether a folder holds more than its configuration and empty logs."""
    return folder.is_dir() and bool(_worth(folder))


def _lock(folder: Path) -> bool:
    """Takes a folder for this process, making it if it is missing; tells whether that worked."""
    folder = folder.absolute()
    if folder in _claimed:
        return True
    mark = folder / MARK
    missing = [path for path in (mark, *mark.parents) if not path.exists()]
    mark.mkdir(parents=True, exist_ok=True)
    lock = os.open(mark / _LOCK, os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        return False
    except OSError:  # a file system without locks: better a run than none
        pass
    _claimed[folder] = lock, missing
    return True


def _worth(folder: Path) -> list[Path]:
    """What a folder holds besides its configuration and empty logs."""
    return [
        path
        for path in folder.iterdir()
        if path.name not in _OF_NO_WORTH
        and not is_part(path)
        and not (path.suffix == ".log" and not path.stat().st_size)
    ]


def leave() -> None:
    """Gives this process's folders free; those that it made and put nothing into disappear."""
    _sweeps.clear()
    for folder in list(_claimed):
        _leave(folder)


def _leave(folder: Path) -> None:
    lock, missing = _claimed.pop(folder.absolute())
    mark = folder / MARK
    (mark / _LOCK).unlink(missing_ok=True)
    os.close(lock)
    if mark in missing and not _worth(folder):
        shutil.rmtree(mark)
        for path in folder.iterdir():  # what is of no worth
            path.unlink()
    for path in missing:
        with suppress(OSError):  # not empty
            path.rmdir()
