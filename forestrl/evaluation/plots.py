"""The two pictures of an evaluation, with the paper's own numbers where they belong."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from forestrl import paper as P
from forestrl.evaluation.episodes import Episodes

_SIZE, _DPI = (6.4, 4.0), 150  # inches, dots per inch: 960 x 600 pixels
_OURS, _THEIRS = "#0072B2", "black"  # a mid grey and black in print
_BARS = "#7FB8D8"
_BIN = 0.025


def coverage_png(episodes: Episodes, *, title: str, paper: Mapping[int, float]) -> bytes:
    """Draws the mean coverage against steps (Fig. 3b).

    Args:
        episodes: what to draw.
        title: stands above the picture.
        paper: the paper's own numbers for this policy in these arenas, by step; shares.

    Returns:
        a PNG file.
    """
    axes = _axes(title, "steps", "coverage of the traversable cells (%)")
    steps, curve = np.arange(episodes.steps + 1), episodes.mean_curve()
    low, high = np.quantile(episodes.coverage, [0.1, 0.9], axis=0)
    axes.fill_between(
        steps, 100 * low, 100 * high, color=_OURS, alpha=0.18, lw=0, label="middle 80 % of arenas"
    )
    if len(episodes) > 1:
        axes.fill_between(
            steps,
            100 * curve.low,
            100 * curve.high,
            color=_OURS,
            alpha=0.45,
            lw=0,
            label="95 % interval of the mean",
        )
    axes.plot(steps, 100 * curve.mean, color=_OURS, lw=1.8, label=f"mean of {_arenas(episodes)}")
    marks = {step: level for step, level in paper.items() if step <= episodes.steps}
    if marks:
        axes.plot(
            list(marks),
            [100 * level for level in marks.values()],
            ls="none",
            marker="D",
            ms=6,
            mfc="white",
            mec=_THEIRS,
            label="paper (Fig. 3b)",
            clip_on=False,
            zorder=5,
        )
    axes.set(xlim=(0, episodes.steps), ylim=(0, 100))
    return _png(axes)


def interventions_png(episodes: Episodes, *, title: str, paper: bool) -> bytes:
    """Draws how the share of steps with an intervention is distributed (Fig. 3c).

    Args:
        episodes: what to draw.
        title: stands above the picture.
        paper: whether the paper's numbers about its policy are marked.

    Returns:
        a PNG file.
    """
    axes = _axes(title, "steps with an intervention (%)", "runs (%)")
    rate = episodes.intervention_rate()
    end = max(0.3, _BIN * np.ceil((rate.max() + 1e-9) / _BIN))
    edges = np.arange(0, end + _BIN / 2, _BIN)
    weight = np.full(len(rate), 100 / len(rate))
    axes.hist(100 * rate, (100 * edges).tolist(), weights=weight, color=_BARS, ec="white", lw=0.8)
    axes.axvline(100 * rate.mean(), color=_OURS, lw=2.2, label=f"mean: {100 * rate.mean():.1f} %")
    if paper:
        label = f"paper's mean: {100 * P.INTERVENTION_RATE:.0f} %"
        axes.axvline(100 * P.INTERVENTION_RATE, color=_THEIRS, lw=1.4, ls="--", label=label)
    share = (rate < P.INTERVENTION_LIMIT).mean()
    label = f"{100 * P.INTERVENTION_LIMIT:.0f} %: {100 * share:.0f} % of runs lie below"
    if paper:
        label += f" (paper: {100 * P.SHARE_UNDER_LIMIT:.0f} %)"
    axes.axvline(100 * P.INTERVENTION_LIMIT, color=_THEIRS, lw=1.4, ls=":", label=label)
    axes.set(xlim=(0, 100 * end), ylim=(0, min(1.05 * axes.get_ylim()[1], 105)))
    return _png(axes)


def _arenas(episodes: Episodes) -> str:
    return "1 arena" if len(episodes) == 1 else f"{len(episodes)} arenas"


def _axes(title: str, xlabel: str, ylabel: str) -> Axes:
    figure = Figure(figsize=_SIZE, dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_title(title, fontsize=11)
    axes.set(xlabel=xlabel, ylabel=ylabel)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="0.88", lw=0.8)
    axes.set_axisbelow(True)
    return axes


def _png(axes: Axes) -> bytes:
    """Puts the legend below the axes, where nothing crosses it, and draws."""
    handles, labels = axes.get_legend_handles_labels()
    axes.figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    buffer = io.BytesIO()
    axes.figure.canvas.print_figure(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()
