"""Explore-Bench's two planners as published, compiled: cost-based and potential field (MMPF).

Both forget everything between steps, and plan the way to their goal in the true arena.
"""

from __future__ import annotations

import numpy as np
from torch import Tensor

from forestrl.functional import Cell
from forestrl.kernels.batches import grids, over_batch
from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import PAD, eight_steps, flood, no_lengths, pad, walk
from forestrl.planners.explore_bench.a_star import a_star_action
from forestrl.planners.explore_bench.clusters import clusters, published_frontier
from forestrl.planners.steps import (
    EXPLORING,
    NO_REACHABLE_FRONTIER,
    arguments,
    status_at_end,
)
from forestrl.status import Status

_FREE = int(Cell.FREE)
_AT_GOAL, _GOAL_NOT_FREE = int(Status.AT_GOAL), int(Status.GOAL_NOT_FREE)
_PENALTY = 5.0  # of a cell, for each time it is in the virtual path
_NOTHING = 10000.0  # potential and distance before the first move


@compiled
def towards(truth: np.ndarray, stride: int, source: int, goal: int) -> tuple[int, int]:
    """Gives action and status for a goal."""
    if goal == source:
        return 0, _AT_GOAL
    if truth[goal] != _FREE:
        return 0, _GOAL_NOT_FREE
    action = a_star_action(truth, stride, source, goal)
    return action, EXPLORING if action > 0 else NO_REACHABLE_FRONTIER


@compiled
def _pad_truth(trees: np.ndarray) -> np.ndarray:
    truth = np.empty(trees.shape, np.uint8)
    for r in range(trees.shape[0]):
        for c in range(trees.shape[1]):
            truth[r, c] = 2 if trees[r, c] else 1
    return pad(truth)


@compiled
def _first_free_around(grid: np.ndarray, stride: int, centre: int) -> int:
    """Gives the first free cell of the 3 x 3 around a cell in row-major order, -1 if none is."""
    for row in range(-stride, stride + 1, stride):
        for cell in range(centre + row - 1, centre + row + 2):
            if grid[cell] == _FREE:
                return cell
    return -1


@over_batch
def _cost(
    first: int,
    last: int,
    cells: np.ndarray,
    position: np.ndarray,
    trees: np.ndarray,
    action: np.ndarray,
    status: np.ndarray,
) -> None:
    stride = cells.shape[2] + 2 * PAD
    steps = eight_steps(stride)
    four = np.array([stride, 1, -stride, -1], np.int32)
    for b in range(first, last):
        grid = pad(cells[b])
        source = (position[b, 0] + PAD) * stride + position[b, 1] + PAD
        centres, _ = clusters(published_frontier(grid, stride), len(grid), stride)
        lengths, _, _ = walk(grid, four, source)
        goal, least = -1, np.int32(0)
        for centre in centres:
            cell = _first_free_around(grid, stride, centre)
            if cell >= 0:
                length = max(lengths[cell], np.int32(0))  # 0 too where it cannot be reached
                if goal < 0 or length < least:
                    goal, least = cell, length
        if goal < 0:
            action[b], status[b] = 0, status_at_end(grid, steps, stride)
        else:
            action[b], status[b] = towards(_pad_truth(trees[b]), stride, source, goal)


@compiled
def _potential(
    four: np.ndarray,
    lengths: np.ndarray,
    queues: np.ndarray,
    ends: np.ndarray,
    sizes: np.ndarray,
    cell: int,
) -> tuple[float, int]:
    """Gives the potential of a free cell and the least distance to a cluster's centre, -1 if none.

    The walks from the centres go on only until they have reached the cell.
    """
    potential, least = 0.0, -1
    for k in range(len(sizes)):
        if lengths[k, cell] < 0 and ends[k, 0] < ends[k, 1]:
            ends[k] = flood(four, lengths[k], queues[k], ends[k, 0], ends[k, 1], cell)
        length = lengths[k, cell]
        if length >= 1:
            potential -= sizes[k] / length
            least = length if least < 0 else min(least, length)
    return potential, least


@compiled
def _lowest(
    grid: np.ndarray, stride: int, source: int, centres: np.ndarray, sizes: np.ndarray
) -> int:
    """Follows the potential downwards from a cell and gives the cell where the descent ends."""
    n = len(centres)
    around = np.array([-stride, -1, stride, 1], np.int32)
    lengths = np.empty((n, len(grid)), np.int32)
    lengths[:] = no_lengths(grid)
    queues = np.empty((n, len(grid)), np.int32)
    ends = np.zeros((n, 2), np.int64)  # of each queue: how many are passed, how many there are
    for k in range(n):
        lengths[k, centres[k]], queues[k, 0], ends[k, 1] = 0, centres[k], 1
    times = np.zeros(len(grid), np.int32)  # in the path
    times[source] = 1
    here, level = source, _NOTHING
    while True:
        best, best_level, best_least = -1, 0.0, -1
        for step in around:
            near = here + step
            value, least = 0.0, 0  # where it is not free, the descent ends
            if grid[near] == _FREE:
                value, least = _potential(around, lengths, queues, ends, sizes, near)
            value += _PENALTY * times[near]
            if best < 0 or value < best_level:
                best, best_level, best_least = near, value, least
        if best_level >= level:
            return here
        here, level = best, best_level
        times[here] += 1
        if 0 <= best_least <= 1:
            return here


@over_batch
def _mmpf(
    first: int,
    last: int,
    cells: np.ndarray,
    position: np.ndarray,
    trees: np.ndarray,
    action: np.ndarray,
    status: np.ndarray,
) -> None:
    stride = cells.shape[2] + 2 * PAD
    for b in range(first, last):
        grid = pad(cells[b])
        source = (position[b, 0] + PAD) * stride + position[b, 1] + PAD
        centres, sizes = clusters(published_frontier(grid, stride), len(grid), stride)
        goal = _lowest(grid, stride, source, centres, sizes)
        action[b], status[b] = towards(_pad_truth(trees[b]), stride, source, goal)


def cost(cells: Tensor, position: Tensor, trees: Tensor) -> tuple[Tensor, Tensor]:
    """Takes a step towards the cluster of frontier cells with the least distance, as published.

    Distances are counted along 4-connected known free cells; a cell without such a path is at
    distance 0, as is the agent's own.

    Args:
        cells: the agent's map, uint8 ``[*B, H, W]``.
        position: int64 ``[*B, 2]``.
        trees: the true arena, for the way to the goal only, bool ``[*B, H, W]``.

    Returns:
        action, int64 ``[*B]``, and :class:`~forestrl.status.Status`, int8 ``[*B]``.
    """
    return _as_published(_cost, cells, position, trees)


def mmpf(cells: Tensor, position: Tensor, trees: Tensor) -> tuple[Tensor, Tensor]:
    """Takes a step towards the lowest point of a potential, as published.

    Every cluster attracts with its number of cells over the distance of its centre along
    4-connected known free cells; the goal is where a descent from the agent's cell ends. Arguments
    and results are those of :func:`cost`.
    """
    return _as_published(_mmpf, cells, position, trees)


def _as_published(
    planner: over_batch, cells: Tensor, position: Tensor, trees: Tensor
) -> tuple[Tensor, Tensor]:
    maps, places, action, status = arguments(cells, position)
    planner(maps, places, grids(trees), action.numpy(), status.numpy())
    return action.view(cells.shape[:-2]), status.view(cells.shape[:-2])
