"""Training curves: returns of several seeds on one axis, smoothed and scaled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forestrl.publishing.files import ResultError
from forestrl.publishing.results import Training
from forestrl.publishing.statistics import bootstrap

_WINDOW = 20_000  # frames over which returns are smoothed
_POINTS = 200


class Returns(NamedTuple):
    """Mean return over trainings, each ``[n]``, scaled so that the mean spans [0, 1]."""

    frames: NDArray[np.float64]
    raw: NDArray[np.float64]
    """Not smoothed."""
    mean: NDArray[np.float64]
    low: NDArray[np.float64]
    """95 % interval over seeds; nan with one."""
    high: NDArray[np.float64]


def returns(trainings: Sequence[Training]) -> Returns:
    """Smooths the episode return of each training and scales their mean to [0, 1] (Fig. 3a).

    Args:
        trainings: one a seed; the shortest ends the curve.

    Raises:
        ResultError: if a training has no return to show.
    """
    curves = [_curve(training) for training in trainings]
    first, last = (max(x[0] for x, _ in curves), min(x[-1] for x, _ in curves))
    frames = np.linspace(first, last, _POINTS)
    smooth = np.stack([smoothed(x, y, frames) for x, y in curves])
    raw = np.mean([np.interp(frames, x, y) for x, y in curves], axis=0)
    mean, low, high = bootstrap(smooth)
    bottom, span = mean.min(), max(float(np.ptp(mean)), 1e-9)
    return Returns(frames, *((part - bottom) / span for part in (raw, mean, low, high)))


def smoothed(
    x: NDArray[np.float64], y: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Averages a curve over a window around each point, narrower towards the ends.

    Args:
        x: frames, ``[rows]``, rising.
        y: the curve, ``[rows]``.
        at: where to average, ``[n]``, from ``x[0]`` to ``x[-1]``.

    Returns:
        ``[n]``.
    """
    half = np.minimum(_WINDOW / 2, np.minimum(at - x[0], x[-1] - at))[:, None]
    near = np.abs(x[None] - at[:, None])
    inside = near <= np.maximum(half, near.min(1, keepdims=True)) + 1e-6
    return (inside * y).sum(1) / inside.sum(1)


def _curve(training: Training) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The frames and returns of the updates in which an episode ended."""
    frames, values = (training.metrics[name] for name in ("frames", "rollout/return"))
    there = ~np.isnan(values)
    if there.sum() < 2:
        raise ResultError(f"{training.path}: fewer than two rows have a rollout/return")
    return frames[there], values[there]
