"""Flat maps with a margin, and flood fills over them.

A flat map has ``PAD`` cells of obstacle around the arena, so that no index needs a check: the arena
is walled. A cell of it is the number ``(row + PAD) * stride + col + PAD`` with
``stride = width + 2 * PAD``; its order is row-major.
"""

from __future__ import annotations

import numpy as np

from forestrl.functional import Cell
from forestrl.kernels.compiling import compiled

PAD = 2
UNREACHED = -1
"""In place of a path length: a free cell that no walk has come to."""
_BLOCKED = -2
_FREE, _OCCUPIED = int(Cell.FREE), int(Cell.OCCUPIED)


@compiled
def pad(cells: np.ndarray) -> np.ndarray:
    """Lays a map out flat with obstacles around it."""
    height, width = cells.shape
    stride = width + 2 * PAD
    grid = np.full((height + 2 * PAD) * stride, _OCCUPIED, np.uint8)
    for r in range(height):
        for c in range(width):
            grid[(r + PAD) * stride + c + PAD] = cells[r, c]
    return grid


@compiled
def eight_steps(stride: int) -> np.ndarray:
    """Differences of cell number to the eight neighbours, in the order of actions 1 to 8."""
    s = stride
    return np.array([-s - 1, -s, -s + 1, -1, 1, s - 1, s, s + 1], np.int32)


@compiled
def no_lengths(grid: np.ndarray) -> np.ndarray:
    """Gives the path lengths before a walk: negative, and different where no walk leads."""
    lengths = np.empty(len(grid), np.int32)
    for cell in range(len(grid)):
        lengths[cell] = UNREACHED if grid[cell] == _FREE else _BLOCKED
    return lengths


@compiled
def flood(
    steps: np.ndarray, lengths: np.ndarray, queue: np.ndarray, head: int, tail: int, target: int
) -> tuple[int, int]:
    """Goes on with a breadth-first walk over free cells until it has reached a cell, or all.

    Args:
        steps: differences of cell number to the neighbours.
        lengths: moves to each cell, of :func:`no_lengths` where not yet reached; written.
        queue: reached cells in the order of their lengths; written.
        head: how many of them have been passed.
        tail: how many there are.
        target: the cell; one of the padding for a walk to the end.

    Returns:
        the new ``head`` and ``tail``.
    """
    while head < tail and lengths[target] < 0:
        cell = queue[head]
        head += 1
        length = lengths[cell] + 1
        for step in steps:
            near = np.uint64(cell + step)  # unsigned: spares numba a check for negative indices
            if lengths[near] == UNREACHED:
                lengths[near] = length
                queue[tail] = near
                tail += 1
    return head, tail


@compiled
def walk(grid: np.ndarray, steps: np.ndarray, source: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Walks breadth-first from a cell to the end: lengths, the cells reached, how many."""
    lengths = no_lengths(grid)
    queue = np.empty(len(grid), np.int32)
    lengths[source] = 0
    queue[0] = source
    _, tail = flood(steps, lengths, queue, 0, 1, 0)
    return lengths, queue, tail
