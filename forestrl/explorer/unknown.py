"""What is unknown: its pockets, and how far away it is."""

from __future__ import annotations

import numpy as np

from forestrl.kernels.compiling import compiled
from forestrl.planners.viewpoints.views import UNKNOWN

_BLOCK = 5  # cells; side of the blocks in which the unknown is summed


@compiled
def pockets(grid: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Gives every unknown cell the size of its 8-connected pocket, int32 ``[cells]``; others 0."""
    size, queue = np.zeros(len(grid), np.int32), np.empty(len(grid), np.int32)
    for start in range(len(grid)):
        if grid[start] != UNKNOWN or size[start] > 0:
            continue
        queue[0], head, tail = start, 0, 1
        size[start] = 1
        while head < tail:
            cell = queue[head]
            head += 1
            for step in steps:
                near = cell + step
                if grid[near] == UNKNOWN and size[near] == 0:
                    size[near] = 1
                    queue[tail] = near
                    tail += 1
        for i in range(tail):
            size[queue[i]] = tail
    return size


@compiled
def blocks_of_unknown(grid: np.ndarray, stride: int, margin: int) -> np.ndarray:
    """Sums the unknown cells by blocks: number, row and col of the middle, float64 ``[n, 3]``."""
    height, width = len(grid) // stride - 2 * margin, stride - 2 * margin
    rows, cols = (height + _BLOCK - 1) // _BLOCK, (width + _BLOCK - 1) // _BLOCK
    count = np.zeros((rows, cols), np.int32)
    for r in range(height):
        for c in range(width):
            count[r // _BLOCK, c // _BLOCK] += grid[(r + margin) * stride + c + margin] == UNKNOWN
    blocks, n = np.empty((rows * cols, 3)), 0
    for a in range(rows):
        for b in range(cols):
            if count[a, b] > 0:
                blocks[n, 0] = count[a, b]
                blocks[n, 1] = a * _BLOCK + _BLOCK // 2 + margin
                blocks[n, 2] = b * _BLOCK + _BLOCK // 2 + margin
                n += 1
    return blocks[:n]


@compiled
def mean_distance(blocks: np.ndarray, row: int, col: int) -> float:
    """Gives the mean Chebyshev distance of unknown cells from a cell, counted by blocks."""
    total, cells = 0.0, 0.0
    for i in range(len(blocks)):
        total += blocks[i, 0] * max(abs(blocks[i, 1] - row), abs(blocks[i, 2] - col))
        cells += blocks[i, 0]
    return total / max(cells, 1.0)
