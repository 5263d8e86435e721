"""The few cells that are worth comparing closely."""

from __future__ import annotations

import numpy as np

from forestrl.kernels.compiling import compiled
from forestrl.planners.viewpoints.paths import Paths

_APART = 3  # units


@compiled
def distance_apart(unit: float) -> int:
    """Gives how far apart candidates are at least, cells; ``unit`` is a fifth of the range."""
    return max(1, int(np.rint(_APART * unit)))


@compiled
def candidates(paths: Paths, stride: int, scores: np.ndarray, apart: int, most: int) -> np.ndarray:
    """Picks the cells with the highest scores, none of them close to a better one.

    Args:
        paths: from the robot.
        stride: of the map.
        scores: of the cells within reach; ties go to the lowest cell number.
        apart: the least Chebyshev distance between two, cells.
        most: how many there may be.

    Returns:
        cell numbers, best first, int64 ``[n]``.
    """
    left = scores.copy()
    picked, n = np.empty(most, np.int64), 0
    while n < most:
        best, best_score = -1, -np.inf
        for i in range(1, len(left)):
            if left[i] > best_score or (
                left[i] == best_score and best >= 0 and paths.order[i] < paths.order[best]
            ):
                best, best_score = i, left[i]
        if best < 0:
            break
        cell = paths.order[best]
        row, col = cell // stride, cell % stride
        picked[n] = cell
        n += 1
        for i in range(1, len(left)):
            other = paths.order[i]
            if abs(other // stride - row) < apart and abs(other % stride - col) < apart:
                left[i] = -np.inf
        left[best] = -np.inf
    return picked[:n]
