"""Means with 95 % intervals: over arenas, over training seeds, and of paired differences."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

_RESAMPLES, _SEED, _BATCH = 2000, 0, 10**6
_NORMAL_95 = 1.959964  # two-sided 95 % quantile of the normal distribution


class Interval(NamedTuple):
    """A mean and its 95 % interval; the interval is nan where one value is all there is."""

    mean: float
    low: float = math.nan
    high: float = math.nan

    @property
    def margin(self) -> float:
        """The larger side of the interval, or nan."""
        return max(self.mean - self.low, self.high - self.mean)


def bootstrap(values: NDArray[np.float64]) -> tuple[NDArray, NDArray, NDArray]:
    """Gives the mean over the first axis and its percentile-bootstrap interval.

    The draws are seeded: the same values give the same interval. With two or three values, such as
    training seeds, the interval is about their range.

    Args:
        values: ``[n, ...]``, one row an arena or a training seed.

    Returns:
        mean, low and high, each ``[...]``; low and high are nan if n = 1.
    """
    mean = values.mean(0)
    if len(values) == 1:
        return mean, np.full_like(mean, np.nan), np.full_like(mean, np.nan)
    interval = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=_RESAMPLES,
        batch=max(1, _BATCH // values.size),  # memory
        method="percentile",
        random_state=_SEED,
    ).confidence_interval
    return mean, interval.low, interval.high


def mean_interval(values: Any) -> Interval | None:
    """Gives the mean of numbers with its interval; nan is left out.

    Args:
        values: one number an arena or a training seed.

    Returns:
        None if no number is left.
    """
    values = np.asarray(values, dtype=np.float64)
    values = values[~np.isnan(values)]
    if len(values) == 0:
        return None
    return Interval(*(float(part) for part in bootstrap(values)))


def normal_interval(values: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Gives the mean of shares over the first axis with a normal interval.

    It is mean ± 1.96 standard errors, cut to [0, 1]; of thousands of means, such as those of a
    curve, it is far cheaper than a bootstrap.

    Args:
        values: shares, ``[n, ...]``.

    Returns:
        mean, low and high, each float64 ``[...]``; low and high are nan if n = 1.
    """
    mean = values.mean(0, dtype=np.float64)
    if len(values) == 1:
        return mean, np.full_like(mean, np.nan), np.full_like(mean, np.nan)
    margin = _NORMAL_95 * values.std(0, dtype=np.float64, ddof=1) / np.sqrt(len(values))
    return mean, np.maximum(mean - margin, 0.0), np.minimum(mean + margin, 1.0)


class Difference(NamedTuple):
    """Mean of a paired difference over the arenas that count, and how many those are."""

    interval: Interval
    arenas: int

    @property
    def sign(self) -> int:
        """1 or -1 if the interval excludes 0, else 0."""
        return int(self.interval.low > 0) - int(self.interval.high < 0)


def paired_difference(first: Mapping[int, float], second: Mapping[int, float]) -> Difference | None:
    """Compares two policies on the same arenas: first minus second.

    Args:
        first: a number for each arena, by the arena's index; nan where there is none.
        second: the other policy's.

    Returns:
        the mean difference over the arenas where both have a number; None if there are none.
    """
    common = sorted(first.keys() & second.keys())
    differences = np.array([first[arena] - second[arena] for arena in common], dtype=np.float64)
    interval = mean_interval(differences)
    count = int((~np.isnan(differences)).sum())
    return None if interval is None else Difference(interval, count)
