"""Paired differences between policies on the same arenas, and the other forests."""

from __future__ import annotations

from forestrl.publishing.results import SETTINGS, Evaluation, Results
from forestrl.publishing.statistics import Difference, paired_difference
from forestrl.publishing.tables import LABELS, Column, forest, markdown, ordered

_PAIRED = (
    Column("coverage at 500", "coverage_500"),
    Column("coverage at the end", "coverage"),
    Column("area to 500", "area_500"),
    Column("area to 2500", "area_2500"),
    Column("steps to 98 %", "steps_to_98", 1.0, 0, min),
    Column("interventions", "intervention_rate", best=min),
)
_FORESTS = (
    *(Column(f"coverage at {step}", f"coverage_{step}") for step in (500, 1000, 2500, 5000)),
    Column("coverage at the end", "coverage_end"),
    Column("reached 98 %", "reached_98"),
    Column("stuck", "stuck"),
    Column("interventions", "intervention_rate"),
)


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
            rows.append([LABELS.get(name, f"`{name}`"), str(whole.arenas), *cells])
    head = [f"{LABELS.get(reference, reference)} minus", "arenas", *(c.head for c in _PAIRED)]
    return markdown(head, rows) if rows else ""


def paired(column: str, ours: Evaluation, theirs: Evaluation) -> Difference | None:
    """Compares two evaluations arena by arena: ours minus theirs.

    Args:
        column: of episodes.csv.
        ours: the first evaluation.
        theirs: the second.

    Returns:
        None if they are not of the same arenas, or there is no arena for which both have a number.
    """
    if _world(ours) != _world(theirs):
        return None
    if any(column not in each.episodes for each in (ours, theirs)):
        return None
    return paired_difference(ours.by_arena(column), theirs.by_arena(column))


def _world(evaluation: Evaluation) -> tuple[object, ...]:
    """Gives what fixes the arenas, and the length of the episodes in them."""
    meta = evaluation.summary["meta"]
    env = {key: meta.get("env", {}).get(key) for key in ("size", "n_trees", "tree_radius")}
    seed = meta.get("eval", {}).get("seed")
    return seed, evaluation.steps, tuple(map(str, env.values()))


def _difference(column: Column, ours: Evaluation, theirs: Evaluation) -> str:
    """A cell: the mean difference, bold where ours is ahead, in italics where theirs is."""
    difference = paired(column.measure, ours, theirs)
    if difference is None:
        return "–"
    text = column.cell(difference.interval)
    if difference.interval.mean > 0:
        text = f"+{text}"
    text = text.replace("-", "−")
    ahead = difference.sign * (1 if column.best is max else -1)
    return {1: f"**{text}**", 0: text, -1: f"*{text}*"}[ahead] + _count(column, difference)


def _count(column: Column, difference: Difference) -> str:
    """The arenas that count, where not all do: both policies must have got there."""
    return f" ({difference.arenas})" if column.measure == "steps_to_98" else ""


def forests(results: Results) -> str:
    """Writes the table of the denser and larger forests; empty if there are none."""
    names = [name for name in (*SETTINGS, *sorted(results.settings.keys() - SETTINGS.keys()))]
    rows = []
    for setting in names:
        methods = results.settings.get(setting, {}) if setting != "nominal" else {}
        for name in ordered(methods):
            method = methods[name]
            cells = [column.cell(method.measure(column.measure)) for column in _FORESTS]
            steps = str(method.first.steps)
            label = LABELS.get(name, f"`{name}`")
            rows.append([forest(setting), label, method.unit, steps, *cells])
    head = ["forest", "policy", "± over", "steps", *(column.head for column in _FORESTS)]
    return markdown(head, rows) if rows else ""
