"""A sweep in one table: a row per override, with means and intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import yaml

from forestrl.evaluation.reading import ResultError, read_summary, read_table
from forestrl.statistics import Interval, mean_interval
from forestrl.storage import csv_text
from forestrl.tables import ARRIVAL, Column, markdown

_TRAINING = (
    Column("frames, at least", "frames", 1.0, 0, min),
    Column("coverage", "eval/coverage"),
    Column("area", "eval/auc"),
    Column("steps to 80 %", "eval/steps_to_80", 1.0, 0),
    Column("steps to 98 %", "eval/steps_to_98", 1.0, 0),
    Column("interventions", "eval/intervention_rate"),
    Column("collisions", "eval/collisions", 1.0, 0),
)
_EVALUATION = (
    Column("coverage", "coverage_end"),
    Column("area to 500", "area_500"),
    Column("area to 2500", "area_2500"),
    ARRIVAL,
    Column("runs that got there", "reached_98"),
    Column("interventions", "intervention_rate"),
    Column("collisions", "collisions", 1.0, 0),
)


class Sweep(NamedTuple):
    """A sweep's tables, and what had to be left out."""

    markdown: str
    csv: str
    skipped: list[str]


class _Job(NamedTuple):
    """The numbers of one job, what its intervals are over, and what it overrode."""

    columns: tuple[Column, ...]
    values: dict[str, Interval | None]
    unit: str
    overrides: list[str]


def aggregate(folder: Path) -> Sweep:
    """Puts the jobs of a sweep into one table, those that differ in their seed into one row.

    A training gives its last evaluation, an evaluation its summary. With several seeds in a row the
    interval is over seeds; an evaluation alone keeps its interval over arenas, and a training alone
    has none. Jobs without any result are left out and named.

    Args:
        folder: of the sweep, with ``<job>/.hydra/overrides.yaml``.

    Raises:
        ResultError: if there is no result at all, or trainings and evaluations are mixed.
    """
    found = folder.glob("*/.hydra/overrides.yaml")
    jobs, skipped = [], []
    for path in sorted(found, key=lambda path: (len(path.parents[1].name), path.parents[1].name)):
        try:
            jobs.append(_read(path.parents[1], overrides(path)))
        except ResultError as error:
            skipped.append(str(error))
    if not jobs:
        nothing = f"sweep={folder} holds no job: it wants <job>/.hydra/overrides.yaml"
        raise ResultError(skipped[0] if skipped else nothing)
    columns = jobs[0].columns
    if any(job.columns is not columns for job in jobs):
        raise ResultError("the sweep mixes trainings and evaluations: no table holds both")
    shared = set.intersection(*(set(job.overrides) for job in jobs))
    rows: dict[str, list[_Job]] = {}
    for job in jobs:
        rows.setdefault(" ".join(_telling(job.overrides, shared)) or "as configured", []).append(
            job
        )
    table = [(name, *_joined(group)) for name, group in rows.items()]
    return Sweep(_markdown(columns, table, shared), _csv(columns, table), skipped)


def overrides(path: Path) -> list[str]:
    """Reads a job's overrides as Hydra wrote them."""
    found = yaml.safe_load(path.read_text(encoding="utf-8"))
    if not isinstance(found, list):
        raise ResultError(f"{path} is not a list of overrides")
    return [str(override) for override in found]


def _telling(overrides: Sequence[str], shared: set[str]) -> list[str]:
    """The overrides that tell one row from the others."""
    return [o for o in overrides if o not in shared and o.lstrip("+").partition("=")[0] != "seed"]


def _read(folder: Path, overrides: list[str]) -> _Job:
    """The numbers of one job, from whichever file it has."""
    if (folder / "summary.json").is_file():
        summary, rows = read_summary(folder / "summary.json")
        rows = rows.rename({f"coverage_{summary['steps']}": "coverage_end"})
        found = {name: Interval(*row) for name, row in rows[["mean", "low", "high"]].iterrows()}
        values = {c.measure: found.get(c.measure) for c in _EVALUATION}
        return _Job(_EVALUATION, values, f"{summary['arenas']} arenas", overrides)
    if not (folder / "metrics.csv").is_file():
        raise ResultError(f"{folder} has neither summary.json nor metrics.csv")
    metrics = read_table(folder / "metrics.csv", ("frames",))
    if "eval/coverage" not in metrics or metrics["eval/coverage"].isna().all():
        raise ResultError(
            f"{folder / 'metrics.csv'} has no evaluation: eval.every was 0, or it ended early"
        )
    last = metrics[metrics["eval/coverage"].notna()].iloc[-1]
    numbers = {c.measure: float(last.get(c.measure, math.nan)) for c in _TRAINING}
    values = {name: None if math.isnan(x) else Interval(x) for name, x in numbers.items()}
    return _Job(_TRAINING, values, "1 seed", overrides)


def _joined(group: list[_Job]) -> tuple[str, dict[str, Interval | None]]:
    """One row of several jobs: what its intervals are over, and its numbers."""
    if len(group) == 1:
        return group[0].unit, group[0].values
    joined = {}
    for column in group[0].columns:
        found = [job.values[column.measure] for job in group]
        numbers = [math.nan if x is None else x.mean for x in found]
        least = column.measure == "frames"
        joined[column.measure] = Interval(min(numbers)) if least else mean_interval(numbers)
    return f"{len(group)} seeds", joined


_Rows = Sequence[tuple[str, str, dict[str, Interval | None]]]


def _markdown(columns: Sequence[Column], rows: _Rows, shared: set[str]) -> str:
    lines = [
        [f"`{name}`", unit, *(column.cell(values[column.measure]) for column in columns)]
        for name, unit, values in rows
    ]
    note = "Shares in per cent; ± is the larger side of the 95 % bootstrap interval of the mean.\n"
    if everywhere := sorted(_telling(sorted(shared), set())):
        note += f"All jobs: `{' '.join(everywhere)}`.\n"
    head = ["override", "± over", *(column.head for column in columns)]
    return markdown(head, lines) + "\n" + note


def _csv(columns: Sequence[Column], rows: _Rows) -> str:
    names = [column.measure for column in columns]
    head = [
        "override",
        "over",
        *(f"{name}{side}" for name in names for side in ("", "_low", "_high")),
    ]
    numbers = ([x for name in names for x in values[name] or (None,) * 3] for *_, values in rows)
    return csv_text(
        [head, *([name, unit, *n] for (name, unit, _), n in zip(rows, numbers, strict=True))]
    )
