"""Tables in Markdown, and the headline table: every policy in the nominal forest."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from forestrl.publishing.elsewhere import BESIDE
from forestrl.publishing.results import SETTINGS, Method, Results
from forestrl.publishing.statistics import Interval

LABELS = {
    "learned": "GATv2 and PPO",
    "learned_mode": "GATv2 and PPO, most probable action",
    "cost_published": "cost-based, as published",
    "cost_corrected": "cost-based, corrected",
    "mmpf_published": "MMPF, as published",
    "mmpf_corrected": "MMPF, corrected",
    "nearest_frontier": "nearest frontier",
    "information_gain": "information gain",
    "random": "random walk",
    "hindsight": "hindsight (sees the whole forest)",
}
"""Known policies, in the order of the tables."""

PRIVILEGED = "hindsight"
_NOT_RANKED = {PRIVILEGED, "learned_mode"}
_OF_FILTER = {"intervention_rate", "percentile_80"}
_MOST = 0.95  # of the runs must get there before their steps to 98 % count as best


class Column(NamedTuple):
    """A column of numbers: what is measured, and how it is written."""

    head: str
    measure: str
    factor: float = 100.0
    digits: int = 1
    best: Callable[..., float] = max

    def cell(self, interval: Interval | None) -> str:
        """Writes a mean and the larger side of its interval."""
        if interval is None:
            return "–"
        if interval.mean == interval.margin == 0 or interval == Interval(0.0):
            return "0"
        text = f"{self.factor * interval.mean:.{self.digits}f}"
        if not math.isnan(interval.margin):
            text += f" ± {self.factor * interval.margin:.{self.digits}f}"
        return text

    def given(self, interval: Interval | None) -> str:
        """Writes a number with no more digits than its source has."""
        if interval is None or not math.isnan(interval.margin):
            return self.cell(interval)
        return f"{round(self.factor * interval.mean, self.digits):g}"


COLUMNS = (
    *(Column(f"coverage at {step}", f"coverage_{step}") for step in (250, 500, 1000, 2000, 2500)),
    Column("steps to 98 %", "steps_to_98", 1.0, 0, min),
    Column("interventions", "intervention_rate", best=min),
    Column("their 80th percentile", "percentile_80", best=min),
    Column("area to 500", "area_500"),
    Column("area to 2500", "area_2500"),
)


class Row(NamedTuple):
    """A row of the headline table: its name, what its intervals are over, and its numbers."""

    label: str
    unit: str
    values: Mapping[str, Interval | None]
    competes: bool = True
    given: bool = False
    """Whether its digits are those of another source."""


def signed(number: float, digits: int = 1) -> str:
    """Writes a number with its sign."""
    return f"{number:+.{digits}f}".replace("-", "−")


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Writes a Markdown table, its first column to the left and the others to the right."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def ordered(methods: Iterable[str]) -> list[str]:
    """Puts policies into the order of the tables, unknown ones last."""
    known = list(LABELS)
    return sorted(methods, key=lambda name: (known.index(name) if name in known else 99, name))


def headline(results: Results) -> str:
    """Writes the headline table of the nominal setting; empty if there is none."""
    methods = results.settings.get("nominal", {})
    if not methods:
        return ""
    rows = list(_headline_rows(methods))
    best = {column.measure: _best(column, rows) for column in COLUMNS}
    lines = []
    for row in rows:
        cells = [_marked(column, row, best[column.measure]) for column in COLUMNS]
        lines.append([row.label, row.unit, *cells])
    return markdown(["policy", "± over", *(column.head for column in COLUMNS)], lines)


def _headline_rows(methods: dict[str, Method]) -> Iterable[Row]:
    """Our rows, and other sources' after them; a method of several seeds has its checkpoint too."""
    for name in ordered(LABELS.keys() | methods.keys()):
        label = LABELS.get(name, f"`{name}`")
        if name in methods:
            method, competes = methods[name], name not in _NOT_RANKED
            yield _row(label, method, competes)
            if len(method.seeds) > 1:
                seed = min(method.seeds)
                checkpoint = Method(name, {seed: method.first})
                yield _row(f"{label}: seed {seed}", checkpoint, competes)
        for other in BESIDE.get(name, ()):
            yield Row(f"*{other.label}*", other.unit, other.values, competes=False, given=True)


def _row(label: str, method: Method, competes: bool) -> Row:
    names = [*(column.measure for column in COLUMNS), "reached_98"]
    return Row(label, method.unit, {name: method.measure(name) for name in names}, competes)


def _best(column: Column, rows: list[Row]) -> str:
    """The text of a column's best value; planners without any intervention do not count there."""
    values = []
    for row in rows:
        value, reached = row.values.get(column.measure), row.values.get("reached_98")
        if value is None or not row.competes:
            continue
        late = column.measure == "steps_to_98" and (reached is None or reached.mean < _MOST)
        needs = row.values.get("intervention_rate")
        never = column.measure in _OF_FILTER and (needs is None or needs.mean == 0)
        if not late and not never:
            values.append(value.mean)
    return column.cell(Interval(column.best(values))) if values else ""


def _marked(column: Column, row: Row, best: str) -> str:
    """A cell, bold if it is the best, with the share of runs that got to 98 %."""
    value, reached = row.values.get(column.measure), row.values.get("reached_98")
    text = column.given(value) if row.given else column.cell(value)
    late = column.measure == "steps_to_98" and (reached is None or reached.mean < _MOST)
    if row.competes and not late and text.partition(" ")[0] == best:
        text = f"**{text}**"
    if column.measure == "steps_to_98" and reached is not None:
        text += f" ({100 * reached.mean:.0f} %)"
    return text


def forest(setting: str) -> str:
    """Says what stands in the arenas of a setting."""
    if setting not in SETTINGS:
        return f"`{setting}`"
    size, trees = SETTINGS[setting]
    return f"h = {size}, {trees} trunks"
