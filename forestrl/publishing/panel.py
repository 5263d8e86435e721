"""What the figures share: axes, bands, and the runs behind them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from forestrl.publishing.drawing import make_axes
from forestrl.publishing.results import Evaluation, Method, Training

STEPS = 2500
"""Steps of an episode in all figures but Fig. 4a."""
_BIN, _END = 0.01, 0.3  # width of a bin; where the axis ends at the least


class Panel(NamedTuple):
    """A figure that can be drawn."""

    draw: Callable[[], Axes]
    caption: str
    sources: tuple[Evaluation | Training, ...]


def wants(*folders: str) -> str:
    """Names the files that a figure without any data wants."""
    return " or ".join(f"{folder}/{{summary.json,episodes.csv,curve.csv}}" for folder in folders)


def sources(methods: Iterable[Method]) -> tuple[Evaluation, ...]:
    """Gives the evaluations behind methods, by seed."""
    return tuple(method.seeds[seed] for method in methods for seed in sorted(method.seeds))


def bands(methods: Iterable[Method]) -> str:
    """Says what the bands around the curves of methods are."""
    several = {len(method.seeds) > 1 for method in methods}
    over = "over training seeds" if several == {True} else "over arenas"
    if len(several) > 1:
        over = "over training seeds where there are several, else over arenas"
    return f"bands: 95 % intervals of the mean {over}"


def rates(method: Method) -> NDArray[np.float64]:
    """Gives the share of steps with an intervention of every run, over all seeds."""
    return np.concatenate([each.episodes["intervention_rate"] for each in sources([method])])


def edges(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gives the edges of the bins of shares, in per cent."""
    end = max(_END, _BIN * np.ceil((values.max() + 1e-9) / _BIN))
    return 100 * np.arange(0, end + _BIN / 2, _BIN)


def coverage_axes(last: int, *, height: float) -> Axes:
    """Makes axes for coverage against steps."""
    axes = make_axes("steps", "coverage (%)", height=height)
    axes.set(xlim=(0, last), ylim=(0, 100))
    axes.set_xticks(np.linspace(0, last, 6))
    return axes
