"""The style of the figures: one column of a paper, told apart by luminance, dashes and markers."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from forestrl.publishing.results import Method
from forestrl.publishing.statistics import bootstrap

WIDTH = 3.5
"""Width of a figure, inches: one column."""
_DPI = 300
_POINTS = 250  # of a curve that are drawn
_STYLE: Any = {
    "font.family": "serif",
    "font.serif": ["STIXGeneral"],
    "mathtext.fontset": "stix",
    "font.size": 9,
    "axes.labelsize": 9,
    "legend.fontsize": 8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "pdf.fonttype": 42,
}


class Line(NamedTuple):
    """How a line looks: in colour, and in grey by luminance, dashes and marker."""

    colour: str
    dashes: str | tuple[int, tuple[float, ...]] = "-"
    marker: str = ""
    width: float = 1.3


LINES = {
    "learned": Line("#08306B", width=2.2),
    "cost_published": Line("#C2410C", (0, (4, 1.5)), "s"),
    "cost_corrected": Line("#C2410C", "-", "s"),
    "mmpf_published": Line("#4D9F7A", (0, (4, 1.5)), "^"),
    "mmpf_corrected": Line("#4D9F7A", "-", "^"),
    "nearest_frontier": Line("#555555", (0, (6, 1.5, 1, 1.5))),
    "information_gain": Line("#7A3E9D", (0, (2, 1)), "o"),
    "random": Line("#909090", (0, (1, 1.2))),
}
"""Lines of Fig. 3b, in the order of its legend."""
ORDINAL = (
    Line("#08306B", width=1.8),
    Line("#2E7EBC", (0, (5, 1.5)), width=1.8),
    Line("#7FB2DA", (0, (1.2, 1.2)), width=1.8),
)
"""Lines of three settings in order: dark to light."""
PAPER: dict[str, Any] = {
    "ls": "none",
    "mec": "black",
    "mfc": "white",
    "mew": 0.9,
    "clip_on": False,
    "zorder": 6,
}
"""Marks of the paper's numbers."""


@contextmanager
def style() -> Iterator[None]:
    """Applies the style to what is drawn inside."""
    with mpl.rc_context(_STYLE):
        yield


def make_axes(xlabel: str, ylabel: str, *, height: float = 2.5) -> Axes:
    """Makes a figure with one pair of axes."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xlabel=xlabel, ylabel=ylabel)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="0.9", lw=0.5)
    axes.set_axisbelow(True)
    return axes


def files(draw: Callable[[], Axes]) -> dict[str, bytes]:
    """Draws a figure and gives it as PNG and PDF, the same bytes every time."""
    written = {}
    with style():
        canvas = draw().figure.canvas
        for kind in ("png", "pdf"):
            buffer, metadata = io.BytesIO(), {"Software": None}
            if kind == "pdf":
                metadata = dict.fromkeys(("Creator", "Producer", "CreationDate"))
            canvas.print_figure(buffer, format=kind, dpi=_DPI, metadata=metadata)
            written[kind] = buffer.getvalue()
    return written


def coverage_curve(
    method: Method, last: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Gives the mean coverage of a method by step, and its band.

    The band is a 95 % interval: over training seeds if there are several, else over arenas.

    Args:
        method: the method.
        last: the last step that is shown.

    Returns:
        steps, mean, low and high, each ``[n]``, in per cent of the traversable cells.
    """
    curves = [evaluation.curve for evaluation in method.seeds.values()]
    end = min([last, *(int(curve["step"][-1]) for curve in curves)])
    steps = np.unique(np.linspace(0, end, _POINTS + 1).round())
    names = ("mean",) if len(curves) > 1 else ("mean", "low", "high")
    each = [
        np.stack([np.interp(steps, curve["step"], 100 * curve[name]) for name in names])
        for curve in curves
    ]
    if len(curves) > 1:
        return steps, *bootstrap(np.stack(each)[:, 0])
    return steps, *each[0]


def draw_curve(axes: Axes, method: Method, *, last: int, line: Line, label: str) -> None:
    """Draws the mean coverage of a method with its band."""
    steps, mean, low, high = coverage_curve(method, last)
    axes.fill_between(steps, low, high, color=line.colour, alpha=0.2, lw=0)
    axes.plot(
        steps,
        mean,
        color=line.colour,
        ls=line.dashes,
        lw=line.width,
        marker=line.marker,
        ms=3.5,
        markevery=(len(steps) // 10, len(steps) // 5),
        label=label,
    )


def legend_below(axes: Axes, columns: int) -> None:
    """Puts the legend under the axes."""
    axes.figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=columns,
                       columnspacing=1.2, handletextpad=0.5, borderaxespad=0.2)  # fmt: skip
