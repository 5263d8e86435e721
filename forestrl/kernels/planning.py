"""What the compiled planners share: first moves, reasons to end; and information gain."""

from __future__ import annotations

from enum import IntEnum
from functools import lru_cache

import numpy as np
import torch
from numba import njit, prange
from torch import Tensor

from forestrl.functional import Cell
from forestrl.kernels.flood import PAD, eight_steps, pad, walk

_UNKNOWN, _FREE = int(Cell.UNKNOWN), int(Cell.FREE)
_MARK = 1 << 24  # more than any path length


class Reason(IntEnum):
    """Why a planner stays where it is for ever."""

    EXPLORING = 0
    """It does not."""
    COVERED = 1
    """No known free cell has an unknown 8-neighbour; in a result, the coverage goal is reached."""
    NO_REACHABLE_FRONTIER = 2
    """There is something left, but nothing the planner's own rule finds and can reach."""
    CYCLE = 3
    """Position and map repeat: it would go round for ever."""
    BUDGET = 4
    """It was still exploring when the steps were used up; only in a result."""
    AT_GOAL = 5
    """Its goal is the cell it stands on."""
    GOAL_NOT_FREE = 6
    """Its goal is a tree or lies outside the arena."""


EXPLORING, COVERED = int(Reason.EXPLORING), int(Reason.COVERED)
NO_REACHABLE_FRONTIER = int(Reason.NO_REACHABLE_FRONTIER)


@njit(cache=True)
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


@njit(cache=True)
def has_frontier(grid: np.ndarray, steps: np.ndarray, stride: int) -> bool:
    """Tells whether a known free cell has an unknown 8-neighbour."""
    for cell in range(PAD * stride, len(grid) - PAD * stride):
        if grid[cell] == _FREE:
            for step in steps:
                if grid[cell + step] == _UNKNOWN:
                    return True
    return False


@njit(cache=True)
def reason_to_end(grid: np.ndarray, steps: np.ndarray, stride: int) -> int:
    """Says why there is nowhere to go: all is covered, or the rest cannot be reached."""
    return NO_REACHABLE_FRONTIER if has_frontier(grid, steps, stride) else COVERED


@njit(cache=True)
def _unknown_in_window(grid: np.ndarray, cell: int, stride: int, width: int, reach: int) -> int:
    """Counts the unknown cells of the arena in the window around a cell."""
    row, col = cell // stride - PAD, cell % stride - PAD
    height = len(grid) // stride - 2 * PAD
    count = 0
    for r in range(max(row - reach, 0), min(row + reach + 1, height)):
        first = (r + PAD) * stride + PAD
        for c in range(first + max(col - reach, 0), first + min(col + reach + 1, width)):
            count += grid[c] == _UNKNOWN
    return count


@njit(cache=True, parallel=True)
def _information_gain(
    cells: np.ndarray,
    position: np.ndarray,
    reach: int,
    cost: np.ndarray,
    action: np.ndarray,
    reason: np.ndarray,
) -> None:
    width = cells.shape[2]
    stride = width + 2 * PAD
    steps = eight_steps(stride)
    for b in prange(len(cells)):
        grid = pad(cells[b])
        source = (position[b, 0] + PAD) * stride + position[b, 1] + PAD
        lengths, queue, tail = walk(grid, steps, source)
        best, best_score = -1, -1.0
        for i in range(1, tail):
            cell = queue[i]
            on_frontier = False
            for step in steps:
                on_frontier |= grid[cell + step] == _UNKNOWN
            if on_frontier:
                gain = _unknown_in_window(grid, cell, stride, width, reach)
                score = gain / cost[lengths[cell]]
                if score > best_score or (score == best_score and cell < best):
                    best, best_score = cell, score
        if best < 0:
            action[b], reason[b] = 0, reason_to_end(grid, steps, stride)
        else:
            action[b], reason[b] = first_action(lengths, steps, source, best, queue), EXPLORING


@lru_cache(maxsize=4)
def _powers(count: int, power: float) -> np.ndarray:
    return np.array([float(n) ** power for n in range(count)])


def information_gain(
    cells: Tensor, position: Tensor, *, window: int, power: float
) -> tuple[Tensor, Tensor]:
    """Takes a step towards the frontier cell with the most gain per path length.

    The gain is the number of unknown cells in the window around the frontier cell; it is divided by
    the number of moves to there, along 8-connected known free cells, to some power. The agent's own
    cell is no goal. Ties go to the first cell in row-major order, then to the lower action.

    Args:
        cells: the agent's map, uint8 ``[*B, H, W]``.
        position: int64 ``[*B, 2]``.
        window: side of the window, cells; odd.
        power: exponent of the path length, 0 or more.

    Returns:
        action, int64 ``[*B]``, and :class:`Reason`, int8 ``[*B]``.
    """
    grids, places, action, reason = arguments(cells, position)
    cost = _powers(grids.shape[-2] * grids.shape[-1] + 1, float(power))
    _information_gain(grids, places, window // 2, cost, action.numpy(), reason.numpy())
    return action.view(cells.shape[:-2]), reason.view(cells.shape[:-2])


def arguments(cells: Tensor, position: Tensor) -> tuple[np.ndarray, np.ndarray, Tensor, Tensor]:
    """Gives map and position with one batch dimension as arrays, and room for the results."""
    grids, places = flat(cells, 2).numpy(), flat(position, 1).numpy()
    n = len(grids)
    return grids, places, torch.zeros(n, dtype=torch.int64), torch.zeros(n, dtype=torch.int8)


def flat(tensor: Tensor, entry_dims: int) -> Tensor:
    """Gives a tensor one batch dimension before the given number of others, contiguous."""
    return tensor.reshape(-1, *tensor.shape[tensor.dim() - entry_dims :]).contiguous()
