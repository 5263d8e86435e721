"""What could be seen of the unknown from every cell, kept up as the map grows.

From a viewpoint an unknown cell *could be seen* if it is within range of the sensor and no known
trunk lies strictly between. Known cells stay known, so what could be seen from a viewpoint only
shrinks, and only near the cells that have become known.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from forestrl.functional import Cell
from forestrl.kernels.compiling import compiled
from forestrl.planners.viewpoints.sight import Sight, popcount

UNKNOWN, FREE, OCCUPIED = int(Cell.UNKNOWN), int(Cell.FREE), int(Cell.OCCUPIED)


class Views(NamedTuple):
    """A flat map and what could be seen from its free cells; a value that is written in place."""

    grid: np.ndarray
    """The map with a margin of obstacle, uint8 ``[cells]``."""
    seen: np.ndarray
    """What could be seen from each cell that may be free, as bits, uint64 ``[cells, words]``."""
    counts: np.ndarray
    """How much that is, ``|S|``, int32 ``[cells]``."""


@compiled
def blank(height: int, width: int, sight: Sight) -> Views:
    """Gives the views of a map on which nothing is known."""
    margin, words = sight.margin, sight.bits.shape[1]
    stride = width + 2 * margin
    grid = np.full((height + 2 * margin) * stride, OCCUPIED, np.uint8)
    for r in range(margin, height + margin):
        for c in range(margin, width + margin):
            grid[r * stride + c] = UNKNOWN
    seen, counts = np.zeros((len(grid), words), np.uint64), np.zeros(len(grid), np.int32)
    for cell in range(len(grid)):
        if grid[cell] == UNKNOWN:
            for k in range(len(sight.offsets)):
                if grid[cell + sight.offsets[k]] == UNKNOWN:
                    counts[cell] += 1
                    for w in range(words):
                        seen[cell, w] |= sight.bits[k, w]
    return Views(grid, seen, counts)


@compiled
def learn(views: Views, sight: Sight, cells: np.ndarray, truth: np.ndarray) -> None:
    """Adds cells to the map, and keeps up what could be seen.

    Args:
        views: the map so far; written.
        sight: lines of sight for its stride.
        cells: numbers of the unknown cells that become known.
        truth: what each of them is.
    """
    words = sight.bits.shape[1]
    for i in range(len(cells)):
        occupied = truth[i] == OCCUPIED
        views.grid[cells[i]] = truth[i]
        for k in range(len(sight.offsets)):
            viewpoint = cells[i] - sight.offsets[k]
            if views.counts[viewpoint] == 0:
                continue
            count = 0
            for w in range(words):
                lost = sight.bits[k, w]
                if occupied:
                    lost |= sight.hides[k, w]
                views.seen[viewpoint, w] &= ~lost
                count += popcount(views.seen[viewpoint, w])
            views.counts[viewpoint] = count
        if occupied:
            spend(views, cells[i])


@compiled
def spend(views: Views, cell: int) -> None:
    """Takes note that nothing more can be seen from a cell: a trunk, or where the robot stood.

    What a scan has not shown is hidden by a trunk, maybe one that the scan has not shown either.
    """
    views.seen[cell] = 0
    views.counts[cell] = 0


@compiled
def update(views: Views, sight: Sight, cells: np.ndarray) -> bool:
    """Brings the views to another map of the same size.

    Args:
        views: of any earlier map, or blank; written.
        sight: lines of sight for the stride.
        cells: the map, uint8 ``[H, W]``.

    Returns:
        whether the map followed from the earlier one; if not, all was found anew.
    """
    height, width = cells.shape
    margin = sight.margin
    stride = width + 2 * margin
    new, truth = np.empty(height * width, np.int64), np.empty(height * width, np.uint8)
    n, follows = 0, True
    for r in range(height):
        first = (r + margin) * stride + margin
        for c in range(width):
            before, now = views.grid[first + c], cells[r, c]
            if before != now:
                new[n], truth[n] = first + c, now
                n += 1
                follows &= before == UNKNOWN
    if not follows:
        n = 0
        anew = blank(height, width, sight)
        views.grid[:], views.seen[:], views.counts[:] = anew.grid, anew.seen, anew.counts
        for r in range(height):
            first = (r + margin) * stride + margin
            for c in range(width):
                if cells[r, c] != UNKNOWN:
                    new[n], truth[n] = first + c, cells[r, c]
                    n += 1
    learn(views, sight, new[:n], truth[:n])
    return follows
