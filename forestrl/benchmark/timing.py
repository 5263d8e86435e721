"""Timing: medians over repeats, within a budget of seconds."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

_WARM_UP = 2  # calls that are not counted


class Timing(NamedTuple):
    """How long one call takes, seconds."""

    median: float
    percentile_99: float
    repeats: int


def measure(
    calls: Mapping[str, Callable[[], Any]], seconds: float, *, least: int = 3, most: int = 2000
) -> dict[str, Timing]:
    """Times calls in turns, so that a slow spell of the machine hits all of them alike.

    Args:
        calls: what to time, by name.
        seconds: budget for each of them.
        least: rounds taken even if the budget is used up.
        most: rounds after which it is enough.

    Returns:
        a timing for each name.
    """
    for _ in range(_WARM_UP):
        for call in calls.values():
            call()
    samples: dict[str, list[float]] = {name: [] for name in calls}
    end = time.perf_counter() + seconds * len(calls)
    rounds = 0
    while rounds < least or (rounds < most and time.perf_counter() < end):
        rounds += 1
        for name, call in calls.items():
            samples[name].append(_timed(call))
    return {name: summary(times) for name, times in samples.items()}


def _timed(call: Callable[[], Any]) -> float:
    """Gives the seconds that one call takes."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def summary(times: list[float]) -> Timing:
    """Sums samples up; the 99th percentile is the nearest rank, of few samples the largest."""
    rank = math.ceil(0.99 * len(times)) - 1
    return Timing(statistics.median(times), sorted(times)[rank], len(times))
