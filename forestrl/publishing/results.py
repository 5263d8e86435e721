"""Committed results read back: ``<folder>/<setting>/<policy>/`` and ``<folder>/training/``."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forestrl.publishing.files import ResultError, read_columns, read_summary
from forestrl.publishing.statistics import Interval, mean_interval

SETTINGS = {
    "nominal": (50, 45),
    "trees60": (50, 60),
    "trees75": (50, 75),
    "size50": (50, 45),
    "size75": (75, 101),
    "size100": (100, 180),
}
"""Arena side and number of trunks of each setting (Fig. 3 and 4); size* run 10,000 steps."""
TRAINING, REFERENCE, FIGURES, ABLATIONS = "training", "training_pyg", "figures", "ablations"
"""Folders beside the settings."""

_EPISODES = ("index", "coverage", "intervention_rate", "steps_to_98")
_CURVE = ("step", "mean", "low", "high")
_MOVING = {"covered", "budget"}  # endings of runs that are not stuck
_SEED = re.compile(r"(?P<name>.+)_seed(?P<seed>\d+)")


@dataclass(frozen=True)
class Evaluation:
    """What ``forestrl eval`` wrote into one folder."""

    folder: Path
    summary: dict[str, Any]
    episodes: dict[str, NDArray[np.float64]]
    """Columns of episodes.csv, each ``[arenas]``; nan where a field is empty."""
    curve: dict[str, NDArray[np.float64]]
    """Columns of curve.csv, each ``[steps + 1]`` or fewer."""

    @property
    def steps(self) -> int:
        """Steps of each episode."""
        return int(self.summary["steps"])

    def measure(self, name: str) -> Interval | None:
        """Gives a mean with its interval over arenas; None if this evaluation cannot know it.

        Args:
            name: as in :func:`measure`.
        """
        kind, _, level = name.rpartition("_")
        found = measure(self.summary, name)
        return self._on_curve(int(level)) if found is None and kind == "coverage" else found

    def _on_curve(self, step: int) -> Interval | None:
        (rows,) = np.nonzero(self.curve["step"] == step)
        if len(rows) == 0:
            return None
        return Interval(*(float(self.curve[part][rows[0]]) for part in ("mean", "low", "high")))

    def by_arena(self, column: str) -> dict[int, float]:
        """Gives a column of episodes.csv by the arena's index."""
        index = self.episodes["index"].astype(int).tolist()
        return dict(zip(index, self.episodes[column].tolist(), strict=True))


@dataclass(frozen=True)
class Method:
    """The evaluations of one method, by training seed; a planner has one under seed 0."""

    name: str
    seeds: dict[int, Evaluation]

    @property
    def first(self) -> Evaluation:
        """The evaluation of the first seed: one checkpoint."""
        return self.seeds[min(self.seeds)]

    def measure(self, name: str) -> Interval | None:
        """Gives a mean with its interval: over training seeds if there are several, else arenas."""
        if len(self.seeds) == 1:
            return self.first.measure(name)
        each = [evaluation.measure(name) for evaluation in self.seeds.values()]
        if None in each and not name.startswith("steps_to"):
            return None
        return mean_interval([math.nan if one is None else one.mean for one in each])

    @property
    def unit(self) -> str:
        """What the intervals are taken over, with its number."""
        several, arenas = len(self.seeds) > 1, self.first.summary["arenas"]
        return f"{len(self.seeds)} seeds" if several else f"{arenas} arenas"


@dataclass(frozen=True)
class Training:
    """The metrics of one training, each column ``[rows]`` with nan where a field is empty."""

    path: Path
    metrics: dict[str, NDArray[np.float64]]


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
    found = sorted(folder.glob("*/*/summary.json")) + sorted(folder.glob("*/*/episodes.csv"))
    folders = sorted({path.parent for path in found})
    training, reference = (_read_trainings(folder / name) for name in (TRAINING, REFERENCE))
    if not folders and not training:
        raise ResultError(
            f"{folder} holds no results: it wants <setting>/<policy>/"
            "{summary.json,episodes.csv,curve.csv} and training/seed<N>.csv"
        )
    settings: dict[str, dict[str, Method]] = {}
    for each in folders:
        match = _SEED.fullmatch(each.name)
        name, seed = (match["name"], int(match["seed"])) if match else (each.name, 0)
        methods = settings.setdefault(each.parent.name, {})
        methods.setdefault(name, Method(name, {})).seeds[seed] = read_evaluation(each)
    return Results(folder, settings, training, reference)


def read_evaluation(folder: Path) -> Evaluation:
    """Reads and checks what ``forestrl eval`` wrote into a folder.

    Raises:
        ResultError: if a file is missing or malformed, or the arenas are not the setting's.
    """
    summary = read_summary(folder / "summary.json")
    episodes = read_columns(folder / "episodes.csv", _EPISODES)
    curve = read_columns(folder / "curve.csv", _CURVE)
    if len(episodes["index"]) != summary["arenas"]:
        raise ResultError(
            f"{folder / 'episodes.csv'} has {len(episodes['index'])} rows, "
            f"summary.json speaks of {summary['arenas']} arenas"
        )
    env, wanted = summary["meta"].get("env", {}), SETTINGS.get(folder.parent.name)
    found = (env.get("size"), env.get("n_trees"))
    if wanted is not None and found != wanted:
        raise ResultError(
            f"{folder} was evaluated with env.size={found[0]} env.n_trees={found[1]}; "
            f"{folder.parent.name} wants {wanted[0]} and {wanted[1]}"
        )
    return Evaluation(folder, summary, episodes, curve)


def measure(summary: dict[str, Any], name: str) -> Interval | None:
    """Gives a mean with its interval over arenas; None if the summary does not hold it.

    Args:
        summary: of an evaluation.
        name: ``coverage_<step>`` or ``coverage_end``, ``area_<upto>``, ``steps_to_<level>``,
            ``reached_<level>``, ``stuck`` (neither covered nor exploring), ``intervention_rate``,
            ``percentile_80``, ``share_under_15`` or ``collisions``.
    """
    kind, _, level = name.rpartition("_")
    if kind == "coverage":
        step = str(summary["steps"]) if level == "end" else level
        return _interval(summary["coverage"].get(step))
    if kind == "area":
        return _interval(summary["area_under_curve"].get(level))
    if kind == "steps_to":
        return _interval(summary["steps_to"].get(level))
    if kind == "reached":
        entry = summary["steps_to"].get(level)
        return None if entry is None else Interval(entry["reached"])
    if name == "stuck":
        ways = summary.get("endings")
        return None if ways is None else Interval(sum(ways[way] for way in ways.keys() - _MOVING))
    if name == "intervention_rate":
        return _interval(summary["interventions"]["rate"])
    return Interval((summary if name == "collisions" else summary["interventions"])[name])


def _read_trainings(folder: Path) -> dict[int, Training]:
    needed = ("frames", "rollout/return")
    paths = sorted(folder.glob("seed*.csv"))
    return {_seed(path): Training(path, read_columns(path, needed)) for path in paths}


def _seed(path: Path) -> int:
    number = path.stem.removeprefix("seed")
    if not number.isdigit():
        raise ResultError(f"{path}: trainings are named seed<N>.csv")
    return int(number)


def _interval(entry: dict[str, float | None] | None) -> Interval | None:
    """An entry of a summary as an interval."""
    if entry is None or entry["mean"] is None:
        return None
    numbers = (entry[name] for name in ("mean", "low", "high"))
    return Interval(*(math.nan if number is None else number for number in numbers))
