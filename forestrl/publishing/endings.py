"""How the runs end: covered, or stuck and why."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from forestrl.publishing.elsewhere import ENDINGS
from forestrl.publishing.panel import sources
from forestrl.publishing.results import Method, Results
from forestrl.publishing.tables import LABELS, markdown, ordered

_HEADS = {
    "covered": "reached 98 %",
    "budget": "steps used up",
    "cycle": "in a cycle",
    "at_goal": "goal is its own cell",
    "goal_not_free": "goal is no free cell",
    "no_reachable_frontier": "sees no goal in reach",
}


def endings(results: Results) -> str:
    """Says how the runs of every policy ended in the nominal forest.

    Returns:
        a Markdown table, empty if no evaluation says it. What no policy comes to has no column.
    """
    methods = results.settings.get("nominal", {})
    found = {name: shares for name in ordered(methods) if (shares := _shares(methods[name]))}
    if not found:
        return ""
    beside = {name: ENDINGS[name] for name in found if name in ENDINGS}
    there = [*found.values(), *(shares for _, _, shares in beside.values())]
    kinds = [kind for kind in _HEADS if any(shares.get(kind, 0) for shares in there)]
    rows = []
    for name, shares in found.items():
        method = methods[name]
        runs = sum(each.summary["arenas"] for each in sources([method]))
        cells = [*_cells(shares, kinds), _left_behind(method)]
        rows.append([LABELS.get(name, f"`{name}`"), str(runs), *cells])
        if name in beside:
            label, runs, theirs = beside[name]
            rows.append([f"*{label}*", str(runs), *_cells(theirs, kinds), "–"])
    head = ["policy", "runs", *(_HEADS[kind] for kind in kinds), "coverage of the others"]
    return markdown(head, rows)


def _shares(method: Method) -> dict[str, float]:
    """The share of the runs, over all seeds, that ended in each way."""
    each = [evaluation.summary for evaluation in sources([method])]
    if any("endings" not in summary for summary in each):
        return {}
    runs = sum(summary["arenas"] for summary in each)
    kinds = {kind for summary in each for kind in summary["endings"]}
    return {
        kind: sum(s["endings"].get(kind, 0.0) * s["arenas"] for s in each) / runs for kind in kinds
    }


def _cells(shares: dict[str, float], kinds: Iterable[str]) -> list[str]:
    return [f"{100 * shares.get(kind, 0.0):.1f}" if shares.get(kind) else "0" for kind in kinds]


def _left_behind(method: Method) -> str:
    """The mean coverage at the end of the runs that did not reach 98 %, in per cent."""
    each = sources([method])
    late = np.concatenate([np.isnan(e.episodes["steps_to_98"]) for e in each])
    coverage = np.concatenate([e.episodes["coverage"] for e in each])[late]
    mean = float(coverage.mean()) if len(coverage) else math.nan
    return "–" if math.isnan(mean) else f"{100 * mean:.1f}"
