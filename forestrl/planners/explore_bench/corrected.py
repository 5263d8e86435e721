"""Explore-Bench's two planners without what gets them stuck, compiled.

Corrected in both: distances are those of the agent's own eight moves, along known free cells, and
what cannot be reached is infinitely far. Where the published rule finds no frontier in reach, every
unknown cell with a neighbour in reach is one; without any the planner is done. A goal is kept until
a cell becomes known, so that the agent arrives. A* plans on the agent's own map, unknown cells
included, not in the true arena.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from forestrl.functional import Cell
from forestrl.kernels.batches import over_batch, rows
from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import PAD, eight_steps, flood, no_lengths, pad, walk
from forestrl.planners.explore_bench.clusters import clusters, corrected_frontier
from forestrl.planners.explore_bench.published import towards
from forestrl.planners.steps import arguments, status_at_end

_UNKNOWN, _FREE = int(Cell.UNKNOWN), int(Cell.FREE)
_PENALTY = 5.0  # of a cell, for each time it is in the virtual path
_LONGEST = 3000  # moves of the virtual path


@compiled
def _nearest(lengths: np.ndarray, steps: np.ndarray, centres: np.ndarray) -> int:
    """Gives the cluster with the shortest path, the first on ties, as the cell to go to.

    That is the first cell around its centre, in row-major order, that can be reached; -1 if there
    is no cluster.
    """
    best = -1
    for centre in centres:
        for step in steps:
            cell = centre + step
            if lengths[cell] >= 0:
                if best < 0 or lengths[cell] < lengths[best]:
                    best = cell
                break
    return best


@compiled
def _potential(
    steps: np.ndarray,
    lengths: np.ndarray,
    queues: np.ndarray,
    ends: np.ndarray,
    sizes: np.ndarray,
    cell: int,
) -> tuple[float, int]:
    """Gives the potential of a free cell in reach and the least distance to a cluster's centre.

    The walks from the centres go on only until they have reached the cell.
    """
    potential, least = 0.0, _LONGEST
    for k in range(len(sizes)):
        if lengths[k, cell] < 0:
            ends[k] = flood(steps, lengths[k], queues[k], ends[k, 0], ends[k, 1], cell)
        potential -= sizes[k] / lengths[k, cell]
        least = min(least, lengths[k, cell])
    return potential, least


@compiled
def _downhill(
    grid: np.ndarray, steps: np.ndarray, source: int, centres: np.ndarray, sizes: np.ndarray
) -> int:
    """Walks where the potential is lowest until beside a cluster's centre; gives that cell.

    Each visit raises a cell, so that the walk fills a local minimum until it flows over.

    Returns:
        the cell, -1 if the walk was too long.
    """
    n = len(centres)
    lengths = np.empty((n, len(grid)), np.int32)
    lengths[:] = no_lengths(grid)
    queues = np.empty((n, len(grid)), np.int32)
    ends = np.zeros((n, 2), np.int64)  # of each queue: how many are passed, how many there are
    for k in range(n):
        lengths[k, centres[k]], queues[k, 0], ends[k, 1] = 0, centres[k], 1
    levels = np.full(len(grid), np.nan)
    least = np.empty(len(grid), np.int32)
    levels[source], least[source] = _potential(steps, lengths, queues, ends, sizes, source)
    here = source
    for _ in range(_LONGEST):
        levels[here] += _PENALTY
        if least[here] <= 1:
            return here
        best = -1
        for step in steps:
            near = here + step
            if grid[near] != _FREE:
                continue
            if np.isnan(levels[near]):
                value = _potential(steps, lengths, queues, ends, sizes, near)
                levels[near], least[near] = value
            if best < 0 or levels[near] < levels[best]:
                best = near
        here = best
    return -1


@compiled
def _find_goal(
    grid: np.ndarray, steps: np.ndarray, stride: int, source: int, downhill: bool
) -> int:
    """Gives the cell to go to, -1 if no frontier can be reached."""
    lengths, _, _ = walk(grid, steps, source)
    found = corrected_frontier(grid, steps, stride, lengths)
    if len(found) == 0:
        return -1
    centres, sizes = clusters(found, len(grid), stride)
    goal = _downhill(grid, steps, source, centres, sizes) if downhill else -1
    return goal if goal >= 0 else _nearest(lengths, steps, centres)


@over_batch
def _plan(
    first: int,
    last: int,
    cells: np.ndarray,
    position: np.ndarray,
    goal: np.ndarray,
    downhill: bool,
    action: np.ndarray,
    status: np.ndarray,
) -> None:
    stride = cells.shape[2] + 2 * PAD
    steps = eight_steps(stride)
    for b in range(first, last):
        grid = pad(cells[b])
        source = (position[b, 0] + PAD) * stride + position[b, 1] + PAD
        target = (goal[b, 0] + PAD) * stride + goal[b, 1] + PAD
        if goal[b, 0] < 0 or target == source:
            target = _find_goal(grid, steps, stride, source, downhill)
            if target < 0:
                action[b], status[b] = 0, status_at_end(grid, steps, stride)
                continue
            goal[b, 0], goal[b, 1] = target // stride - PAD, target % stride - PAD
        for cell in range(len(grid)):
            if grid[cell] == _UNKNOWN:
                grid[cell] = _FREE
        action[b], status[b] = towards(grid, stride, source, target)


def cost(cells: Tensor, position: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Takes a step towards the cluster of frontier cells with the shortest path.

    Args:
        cells: the agent's map, uint8 ``[*B, H, W]``.
        position: int64 ``[*B, 2]``.
        goal: the goal to keep, int64 ``[*B, 2]``; (-1, -1) asks for a new one.

    Returns:
        action, int64 ``[*B]``, :class:`~forestrl.status.Status`, int8 ``[*B]``, and the goal, int64
        ``[*B, 2]``.
    """
    return _planned(cells, position, goal, downhill=False)


def mmpf(cells: Tensor, position: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Takes a step towards the end of a walk down the clusters' potential.

    Arguments and results are those of :func:`cost`.
    """
    return _planned(cells, position, goal, downhill=True)


def _planned(
    cells: Tensor, position: Tensor, goal: Tensor, *, downhill: bool
) -> tuple[Tensor, Tensor, Tensor]:
    maps, places, action, status = arguments(cells, position)
    goals = torch.from_numpy(rows(goal)).clone()
    _plan(maps, places, goals.numpy(), downhill, action.numpy(), status.numpy())
    batch = cells.shape[:-2]
    return action.view(batch), status.view(batch), goals.view(goal.shape)
