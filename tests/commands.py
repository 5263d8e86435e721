"""The real commands, called in this process, as importing torch anew costs seconds."""

from __future__ import annotations

import csv
import io
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import hydra
from hydra import initialize_config_dir
from omegaconf import DictConfig

from forestrl import cli
from forestrl.config import CONF_DIR

SHORT = ("total_frames=256", "eval.every=0")
"""Makes the smoke experiment one update."""


class Result(NamedTuple):
    status: int | str | None
    out: str
    err: str


def forestrl(*arguments: object) -> Result:
    """``forestrl *arguments``: exit status, standard output and standard error."""
    out, err, status = io.StringIO(), io.StringIO(), 0
    before, sys.argv = sys.argv, ["forestrl", *map(str, arguments)]
    try:
        with redirect_stdout(out), redirect_stderr(err):
            cli.main()
    except SystemExit as stop:
        status = stop.code
    finally:
        sys.argv = before
    return Result(status, out.getvalue(), err.getvalue())


def train(folder: Path, *arguments: object) -> Path:
    """Trains the smoke experiment in a folder; gives the folder."""
    result = forestrl("train", "experiment=smoke", f"hydra.run.dir={folder}", *arguments)
    assert result.status == 0, result.err
    return folder


def compose(name: str, *overrides: str, **options: bool) -> DictConfig:
    """The configuration of a command."""
    with initialize_config_dir(CONF_DIR, version_base="1.3"):
        return hydra.compose(name, list(overrides), **options)


def rows(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file without the columns that time the program."""
    with path.open(newline="") as file:
        return [
            {name: value for name, value in row.items() if not name.startswith("time/")}
            for row in csv.DictReader(file)
        ]
