"""What the compiled planners share: first moves, and why there is nowhere to go."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from forestrl.functional import Cell
from forestrl.kernels.batches import grids, rows
from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import PAD
from forestrl.status import Status

_UNKNOWN, _FREE = int(Cell.UNKNOWN), int(Cell.FREE)
_MARK = 1 << 24  # more than any path length


EXPLORING, COVERED = int(Status.EXPLORING), int(Status.COVERED)
NO_REACHABLE_FRONTIER = int(Status.NO_REACHABLE_FRONTIER)


@compiled
def first_action(
    lengths: np.ndarray, steps: np.ndarray, source: int, goal: int, queue: np.ndarray
) -> int:
    """Gives the first action of a shortest path to a cell, ties to the lower index.

    Cells that lie on shortest paths are walked back from the goal; their lengths are overwritten.
    """
    if lengths[goal] <= 0:
        return 0
    queue[0], head, tail = goal, 0, 1
    while lengths[queue[head]] % _MARK > 1:
        cell = queue[head]
        head += 1
        before = lengths[cell] % _MARK - 1
        for step in steps:
            if lengths[cell + step] == before:
                lengths[cell + step] += _MARK
                queue[tail] = cell + step
                tail += 1
    best = len(steps)
    for i in range(head, tail):  # what is left are the neighbours of the source
        for action in range(len(steps)):
            if source + steps[action] == queue[i]:
                best = min(best, action)
    return best + 1


@compiled
def has_frontier(grid: np.ndarray, steps: np.ndarray, stride: int) -> bool:
    """Tells whether a known free cell has an unknown 8-neighbour."""
    for cell in range(PAD * stride, len(grid) - PAD * stride):
        if grid[cell] == _FREE:
            for step in steps:
                if grid[cell + step] == _UNKNOWN:
                    return True
    return False


@compiled
def status_at_end(grid: np.ndarray, steps: np.ndarray, stride: int) -> int:
    """Says why there is nowhere to go: all is covered, or the rest cannot be reached."""
    return NO_REACHABLE_FRONTIER if has_frontier(grid, steps, stride) else COVERED


def arguments(cells: Tensor, position: Tensor) -> tuple[np.ndarray, np.ndarray, Tensor, Tensor]:
    """Gives map and position with one batch dimension as arrays, and room for the results."""
    maps, places = grids(cells), rows(position)
    n = len(maps)
    return maps, places, torch.zeros(n, dtype=torch.int64), torch.zeros(n, dtype=torch.int8)
