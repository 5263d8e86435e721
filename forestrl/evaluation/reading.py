"""Reads back what an evaluation wrote, and compares two of them."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from forestrl.statistics import Difference, Interval, mean_interval, paired_difference

_EPISODES = ("index", "coverage", "intervention_rate", "steps_to_98")
_CURVE = ("step", "mean", "low", "high")
_MEASURES = ("measure", "mean", "low", "high", "n")
_MOVING = {"ended_covered", "ended_budget"}  # of runs that are not stuck


class ResultError(ValueError):
    """A result that is missing, unreadable or not what its place says."""


@dataclass(frozen=True)
class Evaluation:
    """What ``forestrl eval`` wrote into one folder."""

    folder: Path
    summary: dict[str, Any]
    measures: pd.DataFrame
    """Rows of the summary by measure: mean, low, high, n."""
    episodes: pd.DataFrame
    """episodes.csv by the arena's index."""
    curve: pd.DataFrame
    """curve.csv by step: mean, low, high."""

    @property
    def meta(self) -> dict[str, Any]:
        """With what it was made."""
        return self.summary["meta"]

    @property
    def arenas(self) -> int:
        """How many arenas were explored."""
        return int(self.summary["arenas"])

    @property
    def steps(self) -> int:
        """Steps of each episode."""
        return int(self.summary["steps"])

    def measure(self, name: str) -> Interval | None:
        """Gives a mean with its interval over arenas; None if this evaluation cannot know it.

        Args:
            name: a measure of the summary; ``coverage_end``; ``coverage_<step>`` of any step on the
                curve; or ``stuck``, the share of runs that neither covered nor explored on.
        """
        if name == "coverage_end":
            name = f"coverage_{self.steps}"
        if name == "stuck":
            ended = [one for one in self.measures.index if one.startswith("ended_")]
            share = self.measures["mean"].reindex(sorted(set(ended) - _MOVING)).sum()
            return Interval(float(share)) if ended else None
        if name in self.measures.index:
            row = self.measures.loc[name]
            return None if np.isnan(row["mean"]) else Interval(*row[["mean", "low", "high"]])
        kind, _, step = name.rpartition("_")
        if kind == "coverage" and int(step) in self.curve.index:
            return Interval(*self.curve.loc[int(step)])
        return None


@dataclass(frozen=True)
class Method:
    """The evaluations of one method, by training seed; a planner has one under seed 0."""

    name: str
    seeds: dict[int, Evaluation]

    @property
    def first(self) -> Evaluation:
        """The evaluation of the first seed: one checkpoint."""
        return self.seeds[min(self.seeds)]

    @property
    def evaluations(self) -> list[Evaluation]:
        """All evaluations, by seed."""
        return [self.seeds[seed] for seed in sorted(self.seeds)]

    @property
    def unit(self) -> str:
        """What the intervals are taken over, with its number."""
        several = len(self.seeds) > 1
        return f"{len(self.seeds)} seeds" if several else f"{self.first.arenas} arenas"

    @property
    def runs(self) -> int:
        """The number of episodes, over all seeds."""
        return sum(evaluation.arenas for evaluation in self.evaluations)

    def measure(self, name: str) -> Interval | None:
        """Gives a mean with its interval: over training seeds if there are several, else arenas."""
        if len(self.seeds) == 1:
            return self.first.measure(name)
        each = [evaluation.measure(name) for evaluation in self.evaluations]
        if None in each and not name.startswith("steps_to"):
            return None
        return mean_interval([np.nan if one is None else one.mean for one in each])

    def column(self, name: str) -> pd.Series:
        """Gives a column of episodes.csv over all seeds."""
        return pd.concat([evaluation.episodes[name] for evaluation in self.evaluations])


def read_evaluation(folder: Path) -> Evaluation:
    """Reads and checks what ``forestrl eval`` wrote into a folder.

    Raises:
        ResultError: if a file is missing or malformed.
    """
    summary, measures = read_summary(folder / "summary.json")
    episodes = read_table(folder / "episodes.csv", _EPISODES).set_index("index")
    curve = read_table(folder / "curve.csv", _CURVE)[list(_CURVE)].set_index("step")
    if len(episodes) != summary["arenas"]:
        raise ResultError(
            f"{folder / 'episodes.csv'} has {len(episodes)} rows, summary.json speaks of "
            f"{summary['arenas']} arenas"
        )
    return Evaluation(folder, summary, measures, episodes, curve)


def read_summary(path: Path) -> tuple[dict[str, Any], pd.DataFrame]:
    """Reads a summary.json, and its measures as a table.

    Raises:
        ResultError: if it is missing, no JSON, or lacks an entry.
    """
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ResultError(f"{path} is missing") from error
    except ValueError as error:
        raise ResultError(f"{path} is not valid JSON: {error}") from error
    names = ("arenas", "steps", "measures", "meta")
    lacking = [name for name in names if not isinstance(summary, dict) or name not in summary]
    if lacking:
        raise ResultError(f"{path} lacks {', '.join(lacking)}")
    rows = pd.DataFrame(summary["measures"])
    if lacking := [name for name in _MEASURES if name not in rows]:
        raise ResultError(f"{path} lacks {', '.join(lacking)} in its measures")
    return summary, rows.set_index("measure").astype(float)


def read_table(path: Path, needed: Iterable[str]) -> pd.DataFrame:
    """Reads a CSV file whose needed columns are numbers; empty fields become nan.

    Raises:
        ResultError: if it is missing or empty, lacks a column, or holds something else.
    """
    try:
        table = pd.read_csv(path, on_bad_lines="error", index_col=False)
    except FileNotFoundError as error:
        raise ResultError(f"{path} is missing") from error
    except (pd.errors.EmptyDataError, pd.errors.ParserError, UnicodeDecodeError) as error:
        raise ResultError(f"{path} cannot be read: {' '.join(str(error).split())}") from error
    for name in needed:
        if name not in table:
            raise ResultError(f"{path} lacks the column {name}")
        if not pd.api.types.is_numeric_dtype(table[name]):
            wrong = pd.to_numeric(table[name], errors="coerce").isna() & table[name].notna()
            line = int(wrong.argmax())
            raise ResultError(
                f"{path}, line {line + 2}: {name} is {table[name][line]!r}, no number"
            )
    if table.empty:
        raise ResultError(f"{path} has no rows")
    return table


def paired(column: str, ours: Evaluation, theirs: Evaluation) -> Difference | None:
    """Compares two evaluations arena by arena: ours minus theirs.

    Args:
        column: of episodes.csv.
        ours: the first evaluation.
        theirs: the second.

    Returns:
        None if they are not of the same arenas, or there is no arena for which both have a number.
    """
    worlds = [
        (each.steps, each.meta.get("eval", {}).get("seed"), _world(each)) for each in (ours, theirs)
    ]
    if worlds[0] != worlds[1] or any(column not in each.episodes for each in (ours, theirs)):
        return None
    return paired_difference(*(each.episodes[column].to_dict() for each in (ours, theirs)))


def _world(evaluation: Evaluation) -> list[str]:
    env = evaluation.meta.get("env", {})
    return [str(env.get(name)) for name in ("size", "n_trees", "tree_radius", "lidar_range")]


def last_step_ahead(ours: Evaluation, theirs: Evaluation) -> int | None:
    """Gives the last step at which our mean coverage is higher; None if never, or at the end.

    Between the steps that a curve keeps, it is taken as straight.
    """
    steps = np.arange(min(ours.steps, theirs.steps) + 1)
    mine, other = (
        np.interp(steps, each.curve.index, each.curve["mean"]) for each in (ours, theirs)
    )
    (ahead,) = np.nonzero(mine > other)
    return None if len(ahead) == 0 or ahead[-1] == steps[-1] else int(ahead[-1])
