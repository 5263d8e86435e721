"""Fig. 3: training, coverage and interventions in the nominal forest."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from forestrl import paper as P
from forestrl.publishing.drawing import LINES, ORDINAL, PAPER, draw_curve, legend_below, make_axes
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
from forestrl.publishing.results import Results, Training
from forestrl.publishing.tables import LABELS
from forestrl.publishing.training import returns


def fig3a(results: Results, policy: str) -> Panel | str:
    """Draws the return over the frames of training."""
    trainings = [results.training[seed] for seed in sorted(results.training)]
    if not trainings:
        return "training/seed<N>.csv"

    def draw() -> Axes:
        axes = make_axes("frames ($10^5$)", "episode return, scaled", height=2.7)
        frames, raw, mean, low, high = returns(trainings)
        x, line = frames / 1e5, ORDINAL[0]
        if len(trainings) == 1:
            axes.plot(x, raw, color="0.75", lw=0.6, label="not smoothed")
        axes.fill_between(x, low, high, color=line.colour, alpha=0.2, lw=0)
        axes.plot(x, mean, color=line.colour, lw=line.width, label=f"mean of {_seeds(trainings)}")
        if x[-1] >= P.DIP / 1e5:
            axes.axvline(P.DIP / 1e5, color="black", lw=0.8, ls=":", label="paper: small decline")
        if frames[-1] > 1.01 * P.FRAMES:
            axes.axvline(P.FRAMES / 1e5, color="black", lw=0.8, ls="--", label="paper: end")
        axes.set(xlim=(0, x[-1]), ylim=(-0.05, 1.1))
        legend_below(axes, 2)
        return axes

    band = "; band: 95 % interval over seeds" if len(trainings) > 1 else ""
    caption = (
        f"Mean return of training episodes, {_seeds(trainings)}, smoothed over 20 000 frames and "
        f"scaled to [0, 1]{band}. The paper's curve declines a little after 60 000 frames."
    )
    return Panel(draw, caption, tuple(trainings))


def _seeds(trainings: list[Training]) -> str:
    return "1 training" if len(trainings) == 1 else f"{len(trainings)} trainings"


def fig3b(results: Results, policy: str) -> Panel | str:
    """Draws coverage against steps, for the learned policy and the planners."""
    methods = results.settings.get("nominal", {})
    wanted = {policy if name == "learned" else name: line for name, line in LINES.items()}
    found = {name: line for name, line in wanted.items() if name in methods}
    if not found:
        return wants(f"nominal/{policy}")

    def draw() -> Axes:
        axes = coverage_axes(STEPS, height=3.35)
        for name, line in found.items():
            label = LABELS.get(name, name)
            draw_curve(axes, methods[name], last=STEPS, line=line, label=label)
        x, y = list(P.COVERAGE), [100 * share for share in P.COVERAGE.values()]
        axes.plot(x, y, marker="D", ms=5, label="paper: GATv2 and PPO", **PAPER)
        for name, marker in (("cost", "s"), ("mmpf", "^")):
            label = f"paper: {name.upper() if name == 'mmpf' else 'cost-based'}"
            share = 100 * P.BENCHMARKS[name]
            axes.plot([STEPS], [share], marker=marker, ms=5.5, label=label, **PAPER)
        legend_below(axes, 2)
        return axes

    over = bands(methods[name] for name in found)
    caption = (
        f"Mean coverage of the traversable cells, h = 50, 45 trunks; {over}. "
        "Open marks: the paper's numbers."
    )
    return Panel(draw, caption, sources(methods[name] for name in found))


def fig3c(results: Results, policy: str) -> Panel | str:
    """Draws how the share of steps with an intervention is distributed over runs."""
    method = results.method("nominal", policy)
    if method is None:
        return wants(f"nominal/{policy}")
    values = rates(method)

    def draw() -> Axes:
        axes = make_axes("steps with an intervention (%)", "runs (%)", height=2.85)
        bins, weights = edges(values), np.full(len(values), 100 / len(values))
        axes.hist(100 * values, bins.tolist(), weights=weights, color="#A9CBE6", ec="white", lw=0.5)
        mean, share = 100 * values.mean(), 100 * (values < P.INTERVENTION_LIMIT).mean()
        axes.axvline(mean, color="#08306B", lw=1.8, label=f"mean: {mean:.1f} %")
        theirs, limit = 100 * P.INTERVENTION_RATE, 100 * P.INTERVENTION_LIMIT
        axes.axvline(theirs, color="black", lw=1.0, ls="--", label=f"paper's mean: {theirs:.0f} %")
        label = f"{share:.0f} % under {limit:.0f} % (paper: {100 * P.SHARE_UNDER_LIMIT:.0f} %)"
        axes.axvline(limit, color="black", lw=1.0, ls=":", label=label)
        axes.set_xlim(0, bins[-1])
        legend_below(axes, 2)
        return axes

    caption = (
        f"Share of steps in which the safety filter replaced the action, {len(values)} runs, "
        "h = 50, 45 trunks. Broken line: the paper's mean; dotted line: 15 %, under which 80 % of "
        "the paper's runs are."
    )
    return Panel(draw, caption, sources([method]))
