"""Fig. 4: larger and denser forests."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes

from forestrl import paper as P
from forestrl.publishing.drawing import ORDINAL, PAPER, draw_curve, legend_below, make_axes
from forestrl.publishing.panel import (
    STEPS,
    Panel,
    bands,
    coverage_axes,
    edges,
    rates,
    sources,
    wants,
)
from forestrl.publishing.results import SETTINGS, Method, Results
from forestrl.publishing.tables import forest

_SIZES, _DENSITIES = ("size50", "size75", "size100"), ("nominal", "trees60", "trees75")
_MARKERS, _LONG = "o^s", 10_000


def fig4a(results: Results, policy: str) -> Panel | str:
    """Draws coverage against steps in larger arenas."""
    names = {setting: f"h = {SETTINGS[setting][0]}" for setting in _SIZES}
    return _coverage(results, policy, names, _LONG)


def fig4b(results: Results, policy: str) -> Panel | str:
    """Draws coverage against steps with more trunks."""
    names = {setting: f"{SETTINGS[setting][1]} trunks" for setting in _DENSITIES}
    return _coverage(results, policy, names, STEPS)


def fig4c(results: Results, policy: str) -> Panel | str:
    """Draws how the share of steps with an intervention is distributed, by number of trunks."""
    found = _found(results, policy, _DENSITIES)
    if not found:
        return wants(*(f"{setting}/{policy}" for setting in _DENSITIES))

    def draw() -> Axes:
        axes = make_axes("steps with an intervention (%)", "runs (%)", height=2.85)
        bins = edges(np.concatenate([rates(method) for method in found.values()]))
        for setting, method in found.items():
            values, line = rates(method), ORDINAL[_DENSITIES.index(setting)]
            height = 100 * np.histogram(100 * values, bins)[0] / len(values)
            label = f"{SETTINGS[setting][1]} trunks, mean {100 * values.mean():.1f} %"
            axes.stairs(height, bins, color=line.colour, ls=line.dashes, lw=1.5, label=label)
        limit = 100 * P.DENSE_INTERVENTION_RATE
        label = f"paper: about {limit:.0f} % at most"
        axes.axvline(limit, color="black", lw=1.0, ls="--", label=label)
        axes.set_xlim(0, bins[-1])
        legend_below(axes, 2)
        return axes

    caption = (
        "Share of steps in which the safety filter replaced the action; "
        f"{_runs(found)}. Broken line: the paper's rate with 75 trunks, about."
    )
    return Panel(draw, caption, sources(found.values()))


def _coverage(results: Results, policy: str, settings: dict[str, str], last: int) -> Panel | str:
    found = _found(results, policy, settings)
    if not found:
        return wants(*(f"{setting}/{policy}" for setting in settings))

    def draw() -> Axes:
        axes = coverage_axes(last, height=2.85)
        for setting, method in found.items():
            line = ORDINAL[list(settings).index(setting)]
            draw_curve(axes, method, last=last, line=line, label=settings[setting])
        for setting, step in P.PASSED_AT.items():
            if setting in settings:
                label = f"paper: over 80 %, {settings[setting]}"
                marker = _MARKERS[list(settings).index(setting)]
                axes.plot([step], [100 * P.MORE_THAN], marker=marker, ms=5.5, label=label, **PAPER)
        legend_below(axes, 2)
        return axes

    caption = (
        f"Mean coverage of the traversable cells, {_runs(found)}; {bands(found.values())}. "
        "Open marks: the paper's coverage was over 80 % there."
    )
    return Panel(draw, caption, sources(found.values()))


def _found(results: Results, policy: str, settings: Iterable[str]) -> dict[str, Method]:
    """The method's evaluations in those of the settings that were evaluated."""
    found = {setting: results.method(setting, policy) for setting in settings}
    return {setting: method for setting, method in found.items() if method is not None}


def _runs(found: dict[str, Method]) -> str:
    """The forests with their number of runs."""
    each = {name: sum(e.summary["arenas"] for e in sources([m])) for name, m in found.items()}
    return ", ".join(f"{forest(name)} ({runs} runs)" for name, runs in each.items())
