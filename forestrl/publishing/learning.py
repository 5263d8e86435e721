"""Learning with the compiled networks beside learning with PyTorch Geometric's, by frames."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from forestrl.publishing.results import Results, Training
from forestrl.publishing.tables import markdown

_WINDOW = 12_800
"""Frames that are averaged."""
_MEASURES = {"rollout/return": (1.0, 0), "rollout/coverage": (100.0, 1)}
"""Columns of metrics.csv, with the factor and the digits they are shown with."""


def learning(results: Results) -> str:
    """Sets the trainings of both networks side by side, in every whole window of frames.

    Returns:
        a Markdown table: mean over seeds and, in brackets, the least and the most; empty if there
        are no trainings of both.
    """
    ours, theirs = results.training.values(), results.reference.values()
    if not ours or not theirs:
        return ""
    ends = [training.metrics["frames"].max() for training in (*ours, *theirs)]
    rows = []
    for name, (factor, digits) in _MEASURES.items():
        for first in range(0, int(min(ends)) - _WINDOW + 1, _WINDOW):
            fused, pyg = (_means(group, name, first) for group in (ours, theirs))
            meet = max(min(fused), min(pyg)) <= min(max(fused), max(pyg))
            cells = [_cell([factor * x for x in each], digits) for each in (fused, pyg)]
            span = f"{first:,} to {first + _WINDOW:,}"
            rows.append([name, span, *cells, "yes" if meet else "no"])
    return markdown(["measure", "frames", "fused", "pyg", "ranges meet"], rows)


def _means(trainings: Iterable[Training], name: str, first: int) -> list[float]:
    """The mean of a measure in one window, a number for each training."""
    means = []
    for training in trainings:
        frames = training.metrics["frames"]
        inside = (frames > first) & (frames <= first + _WINDOW)
        means.append(float(np.nanmean(training.metrics[name][inside])))
    return means


def _cell(values: list[float], digits: int) -> str:
    mean, low, high = (f"{x:.{digits}f}" for x in (np.mean(values), min(values), max(values)))
    return f"{mean} ({low} to {high})"
