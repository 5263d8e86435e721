"""The style of the figures: one column, told apart by luminance, dashes and markers."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas

from forestrl.evaluation.reading import Method
from forestrl.statistics import bootstrap

_WIDTH, _DPI, _POINTS = 3.5, 300, 250  # inches; dots an inch; of a curve that are drawn
PAPER: Any = {
    "ls": "none",
    "mec": "black",
    "mfc": "white",
    "mew": 0.9,
    "clip_on": False,
    "zorder": 6,
}
"""Marks of the paper's numbers."""


def files(draw: Callable[[], Axes]) -> dict[str, bytes]:
    """Draws a figure and gives it as PNG and PDF, the same bytes every time."""
    written = {}
    with style.context(Path(__file__).with_name("paper.mplstyle")):
        canvas = draw().figure.canvas
        for kind in ("png", "pdf"):
            buffer, metadata = io.BytesIO(), {"Software": None}
            if kind == "pdf":
                metadata = dict.fromkeys(("Creator", "Producer", "CreationDate"))
            canvas.print_figure(buffer, format=kind, dpi=_DPI, metadata=metadata)
            written[kind] = buffer.getvalue()
    return written


def axes_for(xlabel: str, ylabel: str, *, height: float) -> Axes:
    """Makes a figure with one pair of axes."""
    figure = Canvas(figsize=(_WIDTH, height))
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xlabel=xlabel, ylabel=ylabel)
    return axes


def coverage_axes(last: int, *, height: float) -> Axes:
    """Makes axes for coverage against steps."""
    axes = axes_for("steps", "coverage (%)", height=height)
    axes.set(xlim=(0, last), ylim=(0, 100), xticks=np.linspace(0, last, 6))
    return axes


def look(line: Mapping[str, Any]) -> dict[str, Any]:
    """Gives the arguments of a line that the catalogue describes."""
    dashes = (0, tuple(line["dashes"])) if "dashes" in line else "-"
    return {"color": line["colour"], "ls": dashes, "lw": line.get("width", 1.3)}


def draw_curve(
    axes: Axes, method: Method, *, last: int, line: Mapping[str, Any], label: str
) -> None:
    """Draws the mean coverage of a method, with its band: over seeds if several, else arenas."""
    curves = [evaluation.curve for evaluation in method.evaluations]
    end = min([last, *(int(curve.index[-1]) for curve in curves)])
    steps = np.unique(np.linspace(0, end, _POINTS + 1).round())
    each = np.stack(
        [
            [np.interp(steps, c.index, 100 * c[name]) for name in ("mean", "low", "high")]
            for c in curves
        ]
    )
    mean, low, high = bootstrap(each[:, 0]) if len(curves) > 1 else each[0]
    axes.fill_between(steps, low, high, color=line["colour"], alpha=0.2, lw=0)
    mark = {
        "marker": line.get("marker", ""),
        "ms": 3.5,
        "markevery": (len(steps) // 10, len(steps) // 5),
    }
    axes.plot(steps, mean, label=label, **look(line), **mark)


def with_legend(axes: Axes) -> Axes:
    """Puts the legend under the axes."""
    axes.figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2,
                       columnspacing=1.2, handletextpad=0.5, borderaxespad=0.2)  # fmt: skip
    return axes
