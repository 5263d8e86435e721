"""The planner that goes where most is to be seen per way."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated

import numpy as np
import torch
from torch import Tensor

from forestrl import keys as K
from forestrl.functional import Cell
from forestrl.kernels.batches import over_batch, rows
from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import PAD, eight_steps, pad, walk
from forestrl.planners.base import ClassicalPlanner, Key
from forestrl.planners.steps import EXPLORING, arguments, first_action, status_at_end
from forestrl.settings import Range, checked

_UNKNOWN = int(Cell.UNKNOWN)


@compiled
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


@over_batch
def _information_gain(
    first: int,
    last: int,
    cells: np.ndarray,
    position: np.ndarray,
    reach: int,
    cost: np.ndarray,
    action: np.ndarray,
    status: np.ndarray,
    target: np.ndarray,
) -> None:
    width = cells.shape[2]
    stride = width + 2 * PAD
    steps = eight_steps(stride)
    for b in range(first, last):
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
            action[b], status[b] = 0, status_at_end(grid, steps, stride)
        else:
            action[b], status[b] = first_action(lengths, steps, source, best, queue), EXPLORING
            target[b, 0], target[b, 1] = best // stride - PAD, best % stride - PAD


@lru_cache(maxsize=4)
def _powers(count: int, power: float) -> np.ndarray:
    return np.array([float(n) ** power for n in range(count)])


def information_gain(
    cells: Tensor, position: Tensor, *, window: int, power: float
) -> tuple[Tensor, Tensor, Tensor]:
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
        action, int64 ``[*B]``, :class:`~forestrl.status.Status`, int8 ``[*B]``, and the frontier
        cell, int64 ``[*B, 2]``, -1 where there is none.
    """
    maps, places, action, status = arguments(cells, position)
    target = torch.full_like(position, -1)
    cost = _powers(maps.shape[-2] * maps.shape[-1] + 1, float(power))
    results = action.numpy(), status.numpy(), rows(target)
    _information_gain(maps, places, window // 2, cost, *results)
    return action.view(cells.shape[:-2]), status.view(cells.shape[:-2]), target


class InformationGain(ClassicalPlanner):
    """Takes a step towards the frontier with the most information gain per path length.

    The gain is the number of unknown cells in the window around the frontier cell; it is divided by
    the path length, in moves along 8-connected known free cells, to the given power. Ties go to the
    first cell in row-major order, then to the move of the lowest index.

    Args:
        window: side of the window, cells; odd.
        power: 1: gain per move; less: farther frontiers count more; 0: gain alone.

    Raises:
        ValueError: if a value is out of its range.
    """

    @checked
    def __init__(
        self,
        window: Annotated[int, Range(3, 101, odd=True)] = 7,
        power: Annotated[float, Range(0, 10)] = 1.0,
    ) -> None:
        super().__init__(remembers=[K.TARGET])
        self.window, self.power = window, power

    def plan(self, entries: dict[Key, Tensor], changed: Tensor) -> tuple[Tensor, Tensor]:
        """Plans one step."""
        action, status, entries[K.TARGET] = information_gain(
            entries[K.CELLS], entries[K.POSITION], window=self.window, power=self.power
        )
        return action, status
