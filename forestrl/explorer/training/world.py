"""The true arena and the sensor in it, compiled: what a whole episode needs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import walk
from forestrl.planners.viewpoints.sight import Sight
from forestrl.planners.viewpoints.views import FREE, OCCUPIED, UNKNOWN, Views, learn, spend


class Truth(NamedTuple):
    """An arena as a flat map."""

    grid: np.ndarray
    """``FREE`` or ``OCCUPIED``, with a margin of obstacle, uint8 ``[cells]``."""
    traversable: np.ndarray
    """The cells that can be reached from the start, bool ``[cells]``."""
    total: int
    """How many these are."""


@compiled
def lay_out(trees: np.ndarray, row: int, col: int, lines: Sight) -> Truth:
    """Lays an arena out flat.

    Args:
        trees: bool ``[H, W]``.
        row: of the start.
        col: of the start.
        lines: lines of sight for the stride.
    """
    height, width = trees.shape
    margin = lines.margin
    stride = width + 2 * margin
    grid = np.full((height + 2 * margin) * stride, OCCUPIED, np.uint8)
    for r in range(height):
        for c in range(width):
            if not trees[r, c]:
                grid[(r + margin) * stride + c + margin] = FREE
    _, order, total = walk(grid, lines.steps, (row + margin) * stride + col + margin)
    traversable = np.zeros(len(grid), np.bool_)
    for i in range(total):
        traversable[order[i]] = True
    return Truth(grid, traversable, total)


@compiled
def sense(truth: Truth, views: Views, lines: Sight, cell: int) -> int:
    """Scans from a cell; returns how many traversable cells became known."""
    new = np.empty(len(lines.offsets), np.int64)
    what = np.empty(len(lines.offsets), np.uint8)
    n, covered = 0, 0
    for k in range(len(lines.offsets)):
        there = cell + lines.offsets[k]
        if views.grid[there] != UNKNOWN:
            continue
        hidden = False
        for i in range(lines.between.shape[1]):
            hidden |= truth.grid[cell + lines.between[k, i]] == OCCUPIED
        if not hidden:
            new[n], what[n] = there, truth.grid[there]
            covered += truth.traversable[there]
            n += 1
    learn(views, lines, new[:n], what[:n])
    spend(views, cell)
    return covered
