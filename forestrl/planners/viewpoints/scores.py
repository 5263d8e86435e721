"""Scores of the cells that the robot might go to: path gain, and the linear score."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from forestrl.kernels.compiling import compiled
from forestrl.planners.viewpoints.paths import Paths
from forestrl.planners.viewpoints.sight import Sight
from forestrl.planners.viewpoints.views import UNKNOWN, Views

NOWHERE = -1
TERMS = (
    "log_length",
    "log_gain",
    "length",
    "seen_at_end",
    "unknown_near",
    "unknown_around",
    "known_log_length",
    "known_unknown_around",
    "to_border",
    "at_border",
    "along_heading",
    "stay",
    "gain_per_length",
    "diagonal",
)
"""The terms of the linear score. The weight of ``log_gain`` is 1; the number in its place is the
logarithm of how much a cell seen at the end counts against one seen on the way."""
RUNNING = 0.7
"""How much of the heading is kept at a move."""


class Memory(NamedTuple):
    """What is remembered from step to step; written in place."""

    heading: np.ndarray
    """Running sum of the last moves, (row, col), float64 ``[2]``."""
    goal: np.ndarray
    """The goal of the step before as a cell number, int64 ``[1]``; ``NOWHERE`` at the start."""
    idle: np.ndarray
    """Unknown cells at the last step, and the steps since there were more, int64 ``[2]``."""


class Situation(NamedTuple):
    """What the terms of all cells have in common."""

    unit: float
    """A fifth of the sensor's range, cells: the unit of lengths."""
    row: int
    """The robot's, on the flat map."""
    col: int
    """The robot's, on the flat map."""
    last_row: int
    """Of the flat map."""
    last_col: int
    """Of the flat map."""
    margin: int
    """Of the flat map."""
    near: int
    """Reach of the smaller window, cells."""
    far: int
    """Reach of the larger window, cells."""
    known: float
    """Share of the cells that are known."""
    heading: tuple[float, float, float]
    """Running sum of the last moves, (row, col), and its length."""
    goal: int
    """The goal of the step before as a cell number; ``NOWHERE`` at the start."""
    sums: np.ndarray
    """Unknown cells above and to the left, int32 ``[rows + 1, cols + 1]``."""


@compiled
def no_memory() -> Memory:
    """Gives the memory before the first step."""
    return Memory(np.zeros(2), np.full(1, NOWHERE, np.int64), np.zeros(2, np.int64))


@compiled
def remember(memory: Memory, stride: int, source: int, target: int, goal: int) -> None:
    """Takes note of a move and of the goal it was made for."""
    memory.heading[0] = RUNNING * memory.heading[0] + target // stride - source // stride
    memory.heading[1] = RUNNING * memory.heading[1] + target % stride - source % stride
    memory.goal[0] = goal


@compiled
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


@compiled
def in_window(sums: np.ndarray, row: int, col: int, reach: int) -> int:
    """Counts the unknown cells in a window around a cell."""
    top, left = max(row - reach, 0), max(col - reach, 0)
    bottom, right = min(row + reach + 1, len(sums) - 1), min(col + reach + 1, sums.shape[1] - 1)
    return sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]


@compiled
def window_share(sums: np.ndarray, row: int, col: int, reach: int) -> float:
    """Gives the share of unknown cells in a window; what lies outside the map is known."""
    return in_window(sums, row, col, reach) / (2 * reach + 1) ** 2


@compiled
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


@compiled
def situation(views: Views, sight: Sight, stride: int, source: int, memory: Memory) -> Situation:
    """Gathers what the terms of all cells have in common."""
    unit, margin = sight.lidar_range / 5, sight.margin
    sums = unknown_sums(views.grid, stride)
    last_row, last_col = len(views.grid) // stride - 1, stride - 1
    heading = memory.heading
    return Situation(
        unit,
        source // stride,
        source % stride,
        last_row,
        last_col,
        margin,
        int(np.rint(3 * unit)),
        int(np.rint(10 * unit)),
        1 - sums[-1, -1] / ((last_row + 1 - 2 * margin) * (last_col + 1 - 2 * margin)),
        (heading[0], heading[1], np.hypot(heading[0], heading[1])),
        memory.goal[0],
        sums,
    )


@compiled
def terms(
    here: Situation, stride: int, ends: float, cell: int, gain: int, end: int, length: float
) -> tuple[float, ...]:
    """Gives the terms of a cell.

    Args:
        here: what is common to all cells.
        stride: of the map.
        ends: how much a cell seen at the end counts against one seen on the way.
        cell: its number.
        gain: unknown cells that could be seen on the way and at the end, ``G``.
        end: those that could be seen at the end, ``|S|``.
        length: of the way, ``L``, moves.

    Returns:
        the :data:`TERMS`.
    """
    unit = here.unit
    r, c = cell // stride, cell % stride
    log_length = np.log(length)
    around = window_share(here.sums, r, c, here.far)
    border = min(min(r, here.last_row - r), min(c, here.last_col - c)) - here.margin
    dr, dc = r - here.row, c - here.col
    along, stay = 0.0, 0.0
    if here.heading[2] > 0:
        along = dr * here.heading[0] + dc * here.heading[1]
        along /= here.heading[2] * np.sqrt(float(dr * dr + dc * dc))
    if here.goal != NOWHERE:
        stay = 1 / (1 + max(abs(r - here.goal // stride), abs(c - here.goal % stride)) / unit)
    return (
        -log_length,
        np.log(gain + ends * end),
        length / (10 * unit),
        end / (20 * unit * unit),
        window_share(here.sums, r, c, here.near),
        around,
        here.known * log_length,
        here.known * around,
        border / (10 * unit),
        1.0 if border <= 5 * unit else 0.0,
        along,
        stay,
        gain / length / (10 * unit),
        1.0 if abs(dr) == abs(dc) else 0.0,
    )


@compiled
def weighed(values: tuple[float, ...], weights: np.ndarray) -> float:
    """Gives the linear score of a cell's terms."""
    score = values[1]
    for i in range(len(values)):
        if i != 1:
            score += weights[i] * values[i]
    return score


@compiled
def linear(
    views: Views, stride: int, paths: Paths, here: Situation, weights: np.ndarray
) -> np.ndarray:
    """Gives every cell within reach its linear score.

    Args:
        views: the map and what could be seen.
        stride: of the map.
        paths: from the robot.
        here: what is common to all cells.
        weights: of the terms, float64 ``[14]``.

    Returns:
        the scores, in the order of ``paths.order``; minus infinity where nothing is to be seen.
    """
    scores = np.full(len(paths.order), -np.inf)
    ends = np.exp(weights[1])
    for i in range(1, len(paths.order)):
        cell = paths.order[i]
        gain = paths.gains[cell]
        if gain > 0:
            length = float(paths.lengths[cell])
            values = terms(here, stride, ends, cell, gain, views.counts[cell], length)
            scores[i] = weighed(values, weights)
    return scores
