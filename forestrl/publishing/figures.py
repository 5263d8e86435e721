"""Fig. 3 and 4."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from forestrl import paper as P
from forestrl.evaluation.reading import Evaluation, Method, ResultError
from forestrl.publishing.catalogue import forest, label, policies, settings
from forestrl.publishing.drawing import (
    PAPER,
    axes_for,
    coverage_axes,
    draw_curve,
    look,
    with_legend,
)
from forestrl.publishing.results import Results, Training
from forestrl.statistics import bootstrap

STEPS, LONG = 2500, 10_000  # of an episode in all figures, and in Fig. 4a
_BIN, _END = 0.01, 0.3  # width of a bin; where the axis of shares ends at the least
_INSET, _SMOOTHED = 600, 20_000  # steps that Fig. 3b shows at large; frames that are averaged
_SIZES, _DENSITIES = ("size50", "size75", "size100"), ("nominal", "trees60", "trees75")


class Figure(NamedTuple):
    """A figure that can be drawn."""

    draw: Callable[[], Axes]
    caption: str
    sources: tuple[Evaluation | Training, ...]


def figures(results: Results, method: str) -> dict[str, Figure | str]:
    """Gives every figure, or the files that it wants where there is nothing to draw.

    Args:
        results: what was read.
        method: name of the paper's policy in the results.
    """
    makers = (fig3a, fig3b, fig3c, fig4a, fig4b, fig4c)
    return {make.__name__: make(results, method) for make in makers}


def fig3a(results: Results, method: str) -> Figure | str:
    """Draws the return over the frames of training."""
    trainings = [results.training[seed] for seed in sorted(results.training)]
    if not trainings:
        return "training/seed<N>.csv"
    count = "1 training" if len(trainings) == 1 else f"{len(trainings)} trainings"

    def draw() -> Axes:
        axes = axes_for("frames ($10^5$)", "episode return, scaled", height=2.7)
        frames, mean, low, high = returns(trainings)
        x, colour = frames / 1e5, policies()[method]["line"]["colour"]
        axes.fill_between(x, low, high, color=colour, alpha=0.2, lw=0)
        axes.plot(x, mean, color=colour, lw=1.8, label=f"mean of {count}")
        if x[-1] >= P.DIP / 1e5:
            axes.axvline(P.DIP / 1e5, color="black", lw=0.8, ls=":", label="paper: small decline")
        axes.set(xlim=(0, x[-1]), ylim=(-0.05, 1.1))
        return with_legend(axes)

    band = "; band: 95 % interval over seeds" if len(trainings) > 1 else ""
    caption = (
        f"Mean return of training episodes, {count}, smoothed over 20 000 frames and scaled to "
        f"[0, 1]{band}. The paper's curve declines a little after 60 000 frames."
    )
    return Figure(draw, caption, tuple(trainings))


def returns(trainings: list[Training]) -> tuple[NDArray, ...]:
    """Smooths the episode return of each training and scales their mean to [0, 1] (Fig. 3a).

    Args:
        trainings: one a seed; the shortest ends the curve.

    Returns:
        frames, mean, low and high, each ``[n]``; low and high are nan with one training.

    Raises:
        ResultError: if a training has no return to show.
    """
    curves = []
    for training in trainings:
        there = training.metrics[["frames", "rollout/return"]].dropna()
        if len(there) < 2:
            raise ResultError(f"{training.path}: fewer than two rows have a rollout/return")
        curves.append((there["frames"].to_numpy(), there["rollout/return"].to_numpy()))
    first, last = max(x[0] for x, _ in curves), min(x[-1] for x, _ in curves)
    frames = np.linspace(first, last, 200)
    mean, low, high = bootstrap(np.stack([smoothed(x, y, frames) for x, y in curves]))
    bottom, span = mean.min(), max(float(np.ptp(mean)), 1e-9)
    return frames, *((part - bottom) / span for part in (mean, low, high))


def smoothed(x: NDArray, y: NDArray, at: NDArray) -> NDArray:
    """Averages a curve over a window of 20,000 frames around each point, narrower at the ends."""
    half = np.minimum(_SMOOTHED / 2, np.minimum(at - x[0], x[-1] - at))[:, None]
    near = np.abs(x[None] - at[:, None])
    inside = near <= np.maximum(half, near.min(1, keepdims=True)) + 1e-6
    return (inside * y).sum(1) / inside.sum(1)


def fig3b(results: Results, method: str) -> Figure | str:
    """Draws coverage against steps, for all policies, with the beginning at large."""
    methods = results.settings.get("nominal", {})
    found = {
        name: each["line"]
        for name, each in policies().items()
        if "line" in each and name in methods
    }
    if not found:
        return _wants([f"nominal/{method}"])

    def draw() -> Axes:
        axes = coverage_axes(STEPS, height=4.0)
        inset = axes.inset_axes((0.36, 0.1, 0.64, 0.52), xlim=(0, _INSET), ylim=(40, 101))
        inset.tick_params(labelsize=7)
        for name, line in found.items():
            for each, last in ((axes, STEPS), (inset, _INSET)):
                draw_curve(each, methods[name], last=last, line=line, label=label(name))
        x, y = list(P.COVERAGE), [100 * share for share in P.COVERAGE.values()]
        axes.plot(x, y, marker="D", ms=5, label="paper: GATv2 and PPO", **PAPER)
        for name, marker in (("cost-based", "s"), ("MMPF", "^")):
            share = 100 * P.BENCHMARKS[name.removesuffix("-based").lower()]
            axes.plot([STEPS], [share], marker=marker, ms=5.5, label=f"paper: {name}", **PAPER)
        return with_legend(axes)

    caption = (
        f"Mean coverage of the traversable cells, {forest('nominal')}; "
        f"{_bands(methods[name] for name in found)}. Inset: the first {_INSET} steps. Open marks: "
        "the paper's numbers."
    )
    return Figure(draw, caption, _sources(methods[name] for name in found))


def fig3c(results: Results, method: str) -> Figure | str:
    """Draws how the share of steps with an intervention is distributed over runs."""
    theirs, limit = 100 * P.INTERVENTION_RATE, 100 * P.INTERVENTION_LIMIT
    share = f" % of the paper's runs: under {limit:.0f} %"
    marks = {
        f"paper's mean: {theirs:.0f} %": (theirs, "--"),
        f"{100 * P.SHARE_UNDER_LIMIT:.0f}{share}": (limit, ":"),
    }
    return _interventions(results, method, ("nominal",), marks)


def fig4a(results: Results, method: str) -> Figure | str:
    """Draws coverage against steps in larger arenas."""
    return _coverage(
        results, method, {name: f"h = {settings()[name]['size']}" for name in _SIZES}, LONG
    )


def fig4b(results: Results, method: str) -> Figure | str:
    """Draws coverage against steps with more trunks."""
    names = {name: f"{settings()[name]['n_trees']} trunks" for name in _DENSITIES}
    return _coverage(results, method, names, STEPS)


def fig4c(results: Results, method: str) -> Figure | str:
    """Draws how the share of steps with an intervention is distributed, by number of trunks."""
    limit = 100 * P.DENSE_INTERVENTION_RATE
    marks = {f"paper, 75 trunks: about {limit:.0f} % at most": (limit, "--")}
    return _interventions(results, method, _DENSITIES, marks)


def _interventions(
    results: Results, method: str, names: Sequence[str], marks: Mapping[str, tuple[float, str]]
) -> Figure | str:
    found = _found(results, method, names)
    if not found:
        return _wants(f"{setting}/{method}" for setting in names)
    rates = {s: 100 * m.column("intervention_rate").to_numpy() for s, m in found.items()}

    def draw() -> Axes:
        axes = axes_for("steps with an intervention (%)", "runs (%)", height=2.85)
        largest = max(values.max() for values in rates.values()) / 100
        bins = 100 * np.arange(0, max(_END, np.ceil(largest / _BIN + 1e-9) * _BIN) + _BIN / 2, _BIN)
        for setting, values in rates.items():
            height = 100 * np.histogram(values, bins)[0] / len(values)
            text = f"{settings()[setting]['n_trees']} trunks, mean {values.mean():.1f} %"
            axes.stairs(height, bins, label=text, **look(settings()[setting]["line"]))
        for text, (place, dashes) in marks.items():
            axes.axvline(place, color="black", lw=1.0, ls=dashes, label=text)
        axes.set_xlim(0, bins[-1])
        return with_legend(axes)

    caption = (
        f"Share of steps in which the safety filter replaced the action; {_runs(found)}. Vertical "
        "lines: the paper's numbers."
    )
    return Figure(draw, caption, _sources(found.values()))


def _coverage(results: Results, method: str, names: dict[str, str], last: int) -> Figure | str:
    found = _found(results, method, names)
    if not found:
        return _wants(f"{setting}/{method}" for setting in names)
    order = list(names)

    def draw() -> Axes:
        axes = coverage_axes(last, height=2.85)
        for setting, each in found.items():
            line = settings()[setting]["line"]
            draw_curve(axes, each, last=last, line=line, label=names[setting])
        for setting, step in P.PASSED_AT.items():
            if setting in names:
                text, marker = f"paper: over 80 %, {names[setting]}", "o^s"[order.index(setting)]
                axes.plot([step], [100 * P.MORE_THAN], marker=marker, ms=5.5, label=text, **PAPER)
        return with_legend(axes)

    caption = (
        f"Mean coverage of the traversable cells, {_runs(found)}; {_bands(found.values())}. "
        "Open marks: the paper's coverage was over 80 % there."
    )
    return Figure(draw, caption, _sources(found.values()))


def _found(results: Results, method: str, names: Iterable[str]) -> dict[str, Method]:
    """The method's evaluations in those of the settings that were evaluated."""
    found = {setting: results.method(setting, method) for setting in names}
    return {setting: each for setting, each in found.items() if each is not None}


def _wants(folders: Iterable[str]) -> str:
    return " or ".join(f"{folder}/{{summary.json,episodes.csv,curve.csv}}" for folder in folders)


def _sources(methods: Iterable[Method]) -> tuple[Evaluation, ...]:
    return tuple(evaluation for method in methods for evaluation in method.evaluations)


def _runs(found: Mapping[str, Method]) -> str:
    return ", ".join(f"{forest(name)} ({method.runs} runs)" for name, method in found.items())


def _bands(methods: Iterable[Method]) -> str:
    """Says what the bands around the curves of methods are."""
    several = {len(method.seeds) > 1 for method in methods}
    over = "over training seeds" if several == {True} else "over arenas"
    if len(several) > 1:
        over = "over training seeds where there are several, else over arenas"
    return f"bands: 95 % intervals of the mean {over}"
