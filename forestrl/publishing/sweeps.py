"""A sweep in one table: a row per override, with means and intervals."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from forestrl.publishing.files import ResultError, read_columns, read_summary
from forestrl.publishing.results import measure
from forestrl.publishing.statistics import Interval, mean_interval
from forestrl.publishing.tables import Column, markdown

_TRAINING = (
    Column("frames, at least", "frames", 1.0, 0),
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
    Column("steps to 98 %", "steps_to_98", 1.0, 0),
    Column("runs that got there", "reached_98"),
    Column("interventions", "intervention_rate"),
    Column("collisions", "collisions", 1.0, 0),
)


class Job(NamedTuple):
    """One job of a sweep: its folder and what it overrode."""

    folder: Path
    overrides: list[str]


class Sweep(NamedTuple):
    """A sweep's tables, and what had to be left out."""

    markdown: str
    csv: str
    skipped: list[str]


class _Measured(NamedTuple):
    """The numbers of one job."""

    columns: tuple[Column, ...]
    overrides: list[str]
    values: dict[str, Interval | None]
    unit: str


def aggregate(jobs: Sequence[Job]) -> Sweep:
    """Puts the jobs of a sweep into one table, those that differ in their seed into one row.

    A training gives its last evaluation, an evaluation its summary. With several seeds in a row the
    interval is over seeds; an evaluation alone keeps its interval over arenas, and a training alone
    has none. Jobs without any result are left out and named.

    Args:
        jobs: all jobs, in order.

    Raises:
        ResultError: if there is no result at all, or trainings and evaluations are mixed.
    """
    measured, skipped = [], []
    for job in jobs:
        try:
            measured.append(_measure(job))
        except ResultError as error:
            skipped.append(str(error))
    if not measured:
        raise ResultError(skipped[0] if skipped else "the sweep has no jobs")
    columns = measured[0].columns
    if any(one.columns is not columns for one in measured):
        raise ResultError("the sweep mixes trainings and evaluations: no table holds both")
    shared = set.intersection(*(set(one.overrides) for one in measured))
    rows: dict[str, list[_Measured]] = {}
    for one in measured:
        differing = [text for text in one.overrides if _counts(text, shared)]
        rows.setdefault(" ".join(differing) or "as configured", []).append(one)
    table = [(label, *_joined(group, columns)) for label, group in rows.items()]
    return Sweep(_markdown(columns, table, shared), _csv(columns, table), skipped)


def _counts(override: str, shared: set[str]) -> bool:
    return override not in shared and override.lstrip("+").partition("=")[0] != "seed"


def _measure(job: Job) -> _Measured:
    """The numbers of one job, from whichever file it has."""
    summary, metrics = job.folder / "summary.json", job.folder / "metrics.csv"
    if summary.is_file():
        found = read_summary(summary)
        values = {column.measure: measure(found, column.measure) for column in _EVALUATION}
        arenas = f"{found['arenas']} arenas"
        return _Measured(_EVALUATION, job.overrides, values, arenas)
    if not metrics.is_file():
        raise ResultError(f"{job.folder} has neither summary.json nor metrics.csv")
    rows = read_columns(metrics, ("frames",))
    (evaluated,) = np.nonzero(~np.isnan(rows.get("eval/coverage", np.array([math.nan]))))
    if len(evaluated) == 0:
        raise ResultError(f"{metrics} has no evaluation: eval.every was 0, or it ended early")
    last = {name: column[evaluated[-1]] for name, column in rows.items()}
    numbers = {column.measure: last.get(column.measure, math.nan) for column in _TRAINING}
    values = {name: None if math.isnan(x) else Interval(float(x)) for name, x in numbers.items()}
    return _Measured(_TRAINING, job.overrides, values, "1 seed")


def _joined(
    group: list[_Measured], columns: tuple[Column, ...]
) -> tuple[str, dict[str, Interval | None]]:
    """One row of several jobs: what its intervals are over, and its numbers."""
    if len(group) == 1:
        return group[0].unit, group[0].values
    joined = {}
    for column in columns:
        found = (job.values[column.measure] for job in group)
        numbers = [math.nan if x is None else x.mean for x in found]
        least = column.measure == "frames"
        joined[column.measure] = Interval(min(numbers)) if least else mean_interval(numbers)
    return f"{len(group)} seeds", joined


Rows = Iterable[tuple[str, str, dict[str, Interval | None]]]


def _markdown(columns: tuple[Column, ...], rows: Rows, shared: set[str]) -> str:
    lines = [
        [f"`{label}`", unit, *(column.cell(values[column.measure]) for column in columns)]
        for label, unit, values in rows
    ]
    note = "Shares in per cent; ± is the larger side of the 95 % bootstrap interval of the mean.\n"
    everywhere = sorted(text for text in shared if _counts(text, set()))
    if everywhere:
        note += f"All jobs: `{' '.join(everywhere)}`.\n"
    head = ["override", "± over", *(column.head for column in columns)]
    return markdown(head, lines) + "\n" + note


def _csv(columns: tuple[Column, ...], rows: Rows) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    names = [column.measure for column in columns]
    head = (f"{name}{side}" for name in names for side in ("", "_low", "_high"))
    writer.writerow(["override", "over", *head])
    for label, unit, values in rows:
        numbers = (x for name in names for x in values[name] or (math.nan,) * 3)
        writer.writerow([label, unit, *("" if math.isnan(x) else f"{x:.6g}" for x in numbers)])
    return buffer.getvalue()
