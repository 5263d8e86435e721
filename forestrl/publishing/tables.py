"""The tables: every policy, paired differences, endings, other forests, two ways to learn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from forestrl.evaluation.reading import Evaluation, Method, paired
from forestrl.publishing.catalogue import data, forest, label, ordered, policies, ranked, settings
from forestrl.publishing.results import Results
from forestrl.statistics import Interval
from forestrl.tables import ARRIVAL, Column, markdown

_OF_FILTER = {"intervention_rate", "percentile_80"}
_MOST = 0.95  # of the runs must get there before their steps to 98 % count as best
_WINDOW = 12_800  # frames that are averaged to compare trainings


INTERVENTIONS = Column("interventions", "intervention_rate", best=min)
HEADLINE = (
    *(Column(f"coverage at {step}", f"coverage_{step}") for step in (250, 500, 1000, 2000, 2500)),
    ARRIVAL,
    INTERVENTIONS,
    Column("their 80th percentile", "percentile_80", best=min),
    Column("area to 500", "area_500"),
    Column("area to 2500", "area_2500"),
)
SHORT = (HEADLINE[0], HEADLINE[1], HEADLINE[4], ARRIVAL)  # the README's
_PAIRED = (
    Column("coverage at 500", "coverage_500"),
    Column("coverage at the end", "coverage"),
    *HEADLINE[-2:],
    ARRIVAL,
    INTERVENTIONS,
)
_FORESTS = (
    *(Column(f"coverage at {step}", f"coverage_{step}") for step in (500, 1000, 2500, 5000)),
    Column("coverage at the end", "coverage_end"),
    Column("reached 98 %", "reached_98"),
    Column("stuck", "stuck"),
    INTERVENTIONS,
)


class _Line(NamedTuple):
    """A line of the headline table: its name, what its intervals are over, and its numbers."""

    label: str
    unit: str
    values: Mapping[str, Interval | None]
    competes: bool = True
    given: bool = False
    """Whether its digits are those of another source."""


def headline(results: Results) -> str:
    """Writes the table of every policy in the nominal forest; empty if there is none."""
    methods = results.settings.get("nominal", {})
    return _ranked(list(_lines(methods)), HEADLINE) if methods else ""


def short(results: Results) -> str:
    """Writes the README's table: the policies that the catalogue names, a few columns."""
    methods = results.settings.get("nominal", {})
    chosen = [name for name in ordered(methods) if policies().get(name, {}).get("readme")]
    return _ranked([_line(label(n), methods[n], ranked(n)) for n in chosen], SHORT)


def _lines(methods: Mapping[str, Method]) -> Iterable[_Line]:
    """Our lines with other sources' after them; several seeds have a checkpoint's line too."""
    beside = data("elsewhere")["rows"]
    for name in ordered(policies().keys() | methods.keys()):
        if name in methods:
            method = methods[name]
            yield _line(label(name), method, ranked(name))
            if len(method.seeds) > 1:
                seed = min(method.seeds)
                checkpoint = Method(name, {seed: method.first})
                yield _line(f"{label(name)}: seed {seed}", checkpoint, ranked(name))
        for row in beside.get(name, ()):
            values = {
                key: _given(value) for key, value in row.items() if key not in ("label", "over")
            }
            yield _Line(f"*{row['label']}*", row.get("over", ""), values, False, True)


def _given(value: Any) -> Interval:
    """A number from elsewhere, maybe with its standard error."""
    if not isinstance(value, dict):
        return Interval(float(value))
    mean, margin = value["mean"], 1.96 * value["standard_error"]
    return Interval(mean, mean - margin, mean + margin)


def _line(name: str, method: Method, competes: bool) -> _Line:
    names = [*(column.measure for column in HEADLINE), "reached_98"]
    return _Line(name, method.unit, {name: method.measure(name) for name in names}, competes)


def _ranked(lines: Sequence[_Line], columns: Sequence[Column]) -> str:
    best = {column.measure: _best(column, lines) for column in columns}
    rows = [
        [line.label, line.unit, *(_marked(c, line, best[c.measure]) for c in columns)]
        for line in lines
    ]
    return markdown(["policy", "± over", *(column.head for column in columns)], rows)


def _late(column: Column, line: _Line) -> bool:
    """Whether too few runs got there for the column to mean much."""
    reached = line.values.get("reached_98")
    return column is ARRIVAL and (reached is None or reached.mean < _MOST)


def _best(column: Column, lines: Sequence[_Line]) -> str:
    """The text of a column's best value; planners without any intervention do not count there."""
    values = []
    for line in lines:
        value, needs = line.values.get(column.measure), line.values.get("intervention_rate")
        never = column.measure in _OF_FILTER and (needs is None or needs.mean == 0)
        if value is not None and line.competes and not never and not _late(column, line):
            values.append(value.mean)
    return column.cell(Interval(column.best(values))) if values else ""


def _marked(column: Column, line: _Line, best: str) -> str:
    """A cell, bold if it is the best, with the share of runs that got to 98 %."""
    value, reached = line.values.get(column.measure), line.values.get("reached_98")
    text = column.given(value) if line.given else column.cell(value)
    if line.competes and not _late(column, line) and text.partition(" ")[0] == best:
        text = f"**{text}**"
    if column is ARRIVAL and reached is not None:
        text += f" ({100 * reached.mean:.0f} %)"
    return text


def differences(results: Results, reference: str) -> str:
    """Compares the reference's checkpoint with every other policy, arena by arena.

    Returns:
        a Markdown table of reference minus other; empty if there is nothing to compare.
    """
    methods = results.settings.get("nominal", {})
    if reference not in methods:
        return ""
    ours, rows = methods[reference].first, []
    for name in ordered(methods.keys() - {reference}):
        theirs = methods[name].first
        if (whole := paired("coverage", ours, theirs)) is not None:
            cells = [_difference(column, ours, theirs) for column in _PAIRED]
            rows.append([label(name), str(whole.arenas), *cells])
    head = [f"{label(reference)} minus", "arenas", *(column.head for column in _PAIRED)]
    return markdown(head, rows) if rows else ""


def _difference(column: Column, ours: Evaluation, theirs: Evaluation) -> str:
    """A cell: the mean difference, bold where ours is ahead, in italics where theirs is."""
    found = paired(column.measure, ours, theirs)
    if found is None:
        return "–"
    text = column.cell(found.interval).replace("-", "−")
    text = f"+{text}" if found.interval.mean > 0 else text
    ahead = found.sign * (1 if column.best is max else -1)
    text = {1: f"**{text}**", 0: text, -1: f"*{text}*"}[ahead]
    return f"{text} ({found.arenas})" if column is ARRIVAL else text


def endings(results: Results) -> str:
    """Says how the runs of every policy ended in the nominal forest.

    Returns:
        a Markdown table, empty if no evaluation says it. What no policy comes to has no column.
    """
    heads, elsewhere = data("catalogue")["endings"], data("elsewhere")["endings"]
    lines = []
    methods = results.settings.get("nominal", {})
    for name, method in ((name, methods[name]) for name in ordered(methods)):
        if not _ends(method):
            continue
        late = method.column("coverage")[method.column("steps_to_98").isna()]
        left = f"{100 * late.mean():.1f}" if len(late) else "–"
        lines.append((label(name), method.runs, _ends(method), left))
        if name in elsewhere:
            runs = elsewhere[name]["runs"]
            total = sum(runs.values())
            shares = {kind: count / total for kind, count in runs.items()}
            lines.append((f"*{elsewhere[name]['label']}*", total, shares, "–"))
    kinds = [kind for kind in heads if any(line[2].get(kind) for line in lines)]
    rows = [
        [name, str(runs), *(f"{100 * ends[k]:.1f}" if ends.get(k) else "0" for k in kinds), left]
        for name, runs, ends, left in lines
    ]
    head = ["policy", "runs", *(heads[kind] for kind in kinds), "coverage of the others"]
    return markdown(head, rows) if rows else ""


def _ends(method: Method) -> dict[str, float]:
    """The share of the runs, over all seeds, that ended in each way."""
    found: dict[str, float] = {}
    for each in method.evaluations:
        for name, share in each.measures["mean"].items():
            if str(name).startswith("ended_"):
                kind = str(name).removeprefix("ended_")
                found[kind] = found.get(kind, 0.0) + share * each.arenas / method.runs
    return found


def forests(results: Results) -> str:
    """Writes the table of the denser and larger forests; empty if there are none."""
    rows = []
    for setting in (*settings(), *sorted(results.settings.keys() - settings().keys())):
        methods = results.settings.get(setting, {}) if setting != "nominal" else {}
        for name in ordered(methods):
            method = methods[name]
            cells = [column.cell(method.measure(column.measure)) for column in _FORESTS]
            rows.append(
                [forest(setting), label(name), method.unit, str(method.first.steps), *cells]
            )
    head = ["forest", "policy", "± over", "steps", *(column.head for column in _FORESTS)]
    return markdown(head, rows) if rows else ""


def learning(results: Results) -> str:
    """Sets trainings with the compiled networks and with PyTorch Geometric's side by side.

    Every whole window of frames has a row: mean over seeds and, in brackets, least and most.
    """
    groups = [
        [one.metrics for one in each.values()] for each in (results.training, results.reference)
    ]
    if not all(groups):
        return ""
    end, rows = int(min(one["frames"].max() for group in groups for one in group)), []
    for name, factor, digits in (("rollout/return", 1.0, 0), ("rollout/coverage", 100.0, 1)):
        for first in range(1, end - _WINDOW + 2, _WINDOW):
            last = first + _WINDOW - 1
            means = [
                [factor * one[name][one["frames"].between(first, last)].mean() for one in group]
                for group in groups
            ]
            cells = [
                f"{np.mean(x):.{digits}f} ({min(x):.{digits}f} to {max(x):.{digits}f})"
                for x in means
            ]
            meet = "yes" if max(map(min, means)) <= min(map(max, means)) else "no"
            rows.append([name, f"{first - 1:,} to {last:,}", *cells, meet])
    return markdown(["measure", "frames", "fused", "pyg", "ranges meet"], rows)
