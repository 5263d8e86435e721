"""Scores of the cells that the robot might go to: path gain, and the linear score."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from forestrl.planners.viewpoints.paths import Paths
from forestrl.planners.viewpoints.sight import Sight
from forestrl.planners.viewpoints.views import UNKNOWN, Views

NOWHERE = -1
PATH_GAIN = np.array([1.4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.0])
"""The weights of the linear score that make it path gain."""
RUNNING = 0.7
"""How much of the heading is kept at a move."""


class Memory(NamedTuple):
    """What the linear score remembers from step to step; written in place."""

    heading: np.ndarray
    """Running sum of the last moves, (row, col), float64 ``[2]``."""
    goal: np.ndarray
    """The goal of the step before as a cell number, int64 ``[1]``; ``NOWHERE`` at the start."""


@njit(cache=True)
def no_memory() -> Memory:
    """Gives the memory before the first step."""
    return Memory(np.zeros(2), np.full(1, NOWHERE, np.int64))


@njit(cache=True)
def remember(memory: Memory, stride: int, source: int, target: int, goal: int) -> None:
    """Takes note of a move and of the goal it was made for."""
    memory.heading[0] = RUNNING * memory.heading[0] + target // stride - source // stride
    memory.heading[1] = RUNNING * memory.heading[1] + target % stride - source % stride
    memory.goal[0] = goal


@njit(cache=True)
def unknown_sums(grid: np.ndarray, stride: int) -> np.ndarray:
    """Sums the unknown cells above and to the left of every cell, itself included."""
    height = len(grid) // stride
    sums = np.zeros((height + 1, stride + 1), np.int32)
    for r in range(height):
        row = 0
        for c in range(stride):
            row += grid[r * stride + c] == UNKNOWN
            sums[r + 1, c + 1] = sums[r, c + 1] + row
    return sums


@njit(cache=True)
def in_window(sums: np.ndarray, row: int, col: int, reach: int) -> int:
    """Counts the unknown cells in a window around a cell."""
    top, left = max(row - reach, 0), max(col - reach, 0)
    bottom, right = min(row + reach + 1, len(sums) - 1), min(col + reach + 1, sums.shape[1] - 1)
    return sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]


@njit(cache=True)
def path_gain(views: Views, paths: Paths, power: float) -> int:
    """Finds the cell with the most to be seen on the way and at the end, for its path length.

    Ties go to the cell with the lowest number.
    """
    best, best_score = NOWHERE, -1.0
    for i in range(1, len(paths.order)):
        cell = paths.order[i]
        if paths.gains[cell] > 0:
            gain = paths.gains[cell] + views.counts[cell]
            score = gain / float(paths.lengths[cell]) ** power
            if score > best_score or (score == best_score and cell < best):
                best, best_score = cell, score
    return best


@njit(cache=True)
def highest(paths: Paths, scores: np.ndarray) -> int:
    """Gives the cell with the highest score, ties to the lowest number; ``NOWHERE`` if none."""
    best, best_score = NOWHERE, -np.inf
    for i in range(1, len(scores)):
        cell = paths.order[i]
        if scores[i] > best_score or (scores[i] == best_score and cell < best):
            best, best_score = cell, scores[i]
    return best


@njit(cache=True)
def linear(
    views: Views, sight: Sight, stride: int, paths: Paths, memory: Memory, w: np.ndarray
) -> np.ndarray:
    """Gives every cell within reach its linear score.

    Lengths are taken in units of a fifth of the sensor's range.

    Args:
        views: the map and what could be seen.
        sight: lines of sight.
        stride: of the map.
        paths: from the robot.
        memory: heading and last goal.
        w: the fourteen weights.

    Returns:
        the scores, in the order of ``paths.order``; minus infinity where nothing is to be seen.
    """
    unit = sight.lidar_range / 5
    near, far = int(np.rint(3 * unit)), int(np.rint(10 * unit))
    sums = unknown_sums(views.grid, stride)
    last = len(views.grid) // stride - 1
    margin, source = sight.margin, paths.order[0]
    known = 1 - sums[-1, -1] / ((last + 1 - 2 * margin) * (stride - 2 * margin))
    row, col = source // stride, source % stride
    pace = np.hypot(memory.heading[0], memory.heading[1])
    goal = memory.goal[0]
    log_ends = np.exp(w[1])
    scores = np.full(len(paths.order), -np.inf)
    for i in range(1, len(paths.order)):
        cell = paths.order[i]
        gain, end, length = paths.gains[cell], views.counts[cell], float(paths.lengths[cell])
        if gain == 0:
            continue
        r, c = cell // stride, cell % stride
        log_length = np.log(length)
        score = np.log(gain + log_ends * end) + (w[6] * known - w[0]) * log_length
        score += w[2] * length / (10 * unit) + w[3] * end / (20 * unit * unit)
        score += w[4] * in_window(sums, r, c, near) / (2 * near + 1) ** 2
        around = in_window(sums, r, c, far) / (2 * far + 1) ** 2
        score += (w[5] + w[7] * known) * around
        border = min(min(r, last - r), min(c, stride - 1 - c)) - margin
        score += w[8] * border / (10 * unit) + (w[9] if border <= 5 * unit else 0.0)
        dr, dc = r - row, c - col
        if pace > 0:
            along = dr * memory.heading[0] + dc * memory.heading[1]
            score += w[10] * along / (pace * np.sqrt(float(dr * dr + dc * dc)))
        if goal != NOWHERE:
            away = max(abs(r - goal // stride), abs(c - goal % stride))
            score += w[11] / (1 + away / unit)
        score += w[12] * gain / length / (10 * unit)
        score += w[13] if abs(dr) == abs(dc) else 0.0
        scores[i] = score
    return scores
