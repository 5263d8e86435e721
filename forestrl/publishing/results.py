"""Committed results read back: ``<folder>/<setting>/<policy>/`` and ``<folder>/training/``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from forestrl.evaluation.reading import (
    Evaluation,
    Method,
    ResultError,
    read_evaluation,
    read_table,
)
from forestrl.publishing.catalogue import settings

_SEED = re.compile(r"(?P<name>.+)_seed(?P<seed>\d+)")


@dataclass(frozen=True)
class Training:
    """The metrics of one training, and where they were read."""

    path: Path
    metrics: pd.DataFrame


@dataclass(frozen=True)
class Results:
    """Everything in a results folder."""

    folder: Path
    settings: dict[str, dict[str, Method]]
    """Methods by setting and name."""
    training: dict[int, Training]
    """Trainings by seed."""
    reference: dict[int, Training]
    """Trainings with PyTorch Geometric's layers, by seed."""

    def method(self, setting: str, name: str) -> Method | None:
        """Gives a method's evaluations in a setting, if there are any."""
        return self.settings.get(setting, {}).get(name)


def read_results(folder: Path) -> Results:
    """Reads and checks a results folder.

    Raises:
        ResultError: if it holds nothing, or a file is missing or malformed.
    """
    names = ("summary.json", "episodes.csv")
    folders = sorted({path.parent for name in names for path in folder.glob(f"*/*/{name}")})
    training, reference = (_read_trainings(folder / n) for n in ("training", "training_pyg"))
    if not folders and not training:
        raise ResultError(
            f"{folder} holds no results: it wants <setting>/<policy>/"
            "{summary.json,episodes.csv,curve.csv} and training/seed<N>.csv"
        )
    found: dict[str, dict[str, Method]] = {}
    for each in folders:
        match = _SEED.fullmatch(each.name)
        name, seed = (match["name"], int(match["seed"])) if match else (each.name, 0)
        methods = found.setdefault(each.parent.name, {})
        methods.setdefault(name, Method(name, {})).seeds[seed] = _read(each)
    return Results(folder, found, training, reference)


def _read(folder: Path) -> Evaluation:
    """Reads an evaluation, and checks that it is of its setting's arenas."""
    evaluation = read_evaluation(folder)
    wanted, env = settings().get(folder.parent.name), evaluation.meta.get("env", {})
    if wanted is not None and any(env.get(name) != wanted[name] for name in ("size", "n_trees")):
        raise ResultError(
            f"{folder} was evaluated with env.size={env.get('size')} "
            f"env.n_trees={env.get('n_trees')}; {folder.parent.name} wants {wanted['size']} and "
            f"{wanted['n_trees']}"
        )
    return evaluation


def _read_trainings(folder: Path) -> dict[int, Training]:
    found = {}
    for path in sorted(folder.glob("seed*.csv")):
        number = path.stem.removeprefix("seed")
        if not number.isdigit():
            raise ResultError(f"{path}: trainings are named seed<N>.csv")
        found[int(number)] = Training(path, read_table(path, ("frames", "rollout/return")))
    return found
