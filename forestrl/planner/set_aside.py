"""Goals that could not be reached: set aside for a while, then tried again."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from forestrl.planner.decision import Point

_LONGEST = 64  # times the first wait


class SetAside:
    """The goals that failed, each with the time from when it may be tried again.

    A goal that fails again waits twice as long as before.

    Args:
        wait: seconds until a goal is tried again for the first time.
    """

    def __init__(self, wait: float) -> None:
        self.wait = wait
        self._until: dict[Point, float] = {}
        self._waits: dict[Point, float] = {}

    def add(self, goal: Point, now: float, radius: float) -> None:
        """Sets a goal aside.

        Args:
            goal: (x, y), metres.
            now: seconds.
            radius: metres; a goal nearer than this to one that failed before is the same.
        """
        same = [other for other in self._until if math.dist(goal, other) < radius]
        wait = self.wait
        for other in same:
            wait = max(wait, min(2 * self._waits.pop(other), _LONGEST * self.wait))
            del self._until[other]
        self._until[goal], self._waits[goal] = now + wait, wait

    def goals(self, now: float) -> np.ndarray:
        """Gives those that are still to be let alone, (x, y), float64 ``[n, 2]``."""
        left = [goal for goal, until in self._until.items() if until > now]
        return np.array(left, dtype=np.float64).reshape(-1, 2)

    def next_try(self, now: float) -> float:
        """Gives the seconds until the first of them may be tried again; 0 if there is none."""
        return min((until - now for until in self._until.values() if until > now), default=0.0)

    def state(self, now: float) -> list[list[float]]:
        """Gives all as numbers: x, y, the seconds left and the whole wait."""
        return [[*goal, until - now, self._waits[goal]] for goal, until in self._until.items()]

    def restore(self, state: list[Any], now: float) -> None:
        """Takes up what :meth:`SetAside.state` gave."""
        self._until, self._waits = {}, {}
        for x, y, left, wait in state:
            self._until[x, y], self._waits[x, y] = now + left, wait
