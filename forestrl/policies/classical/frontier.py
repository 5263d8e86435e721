"""Planners that pick one frontier cell: the nearest one, or the one with most to see per way."""

from __future__ import annotations

import torch
from torch import Tensor

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.kernels import planning
from forestrl.policies.classical.planner import Key, Planner, Reason


class NearestFrontier(Planner):
    """Takes a step towards the frontier with the shortest path, planning anew at every step.

    Paths lead through known free cells along 8-connected moves. Among equally near frontiers the
    first in row-major order is the goal; among equally good moves the lowest index is taken. With
    no frontier in reach the agent stays.
    """

    def plan(self, entries: dict[Key, Tensor], changed: Tensor) -> tuple[Tensor, Tensor]:
        """Plans one step."""
        cells, position = entries[K.CELLS], entries[K.POSITION]
        free, frontier = cells == F.Cell.FREE, F.frontier(cells)
        lengths = kernels.path_lengths(free, position)
        lengths = lengths.masked_fill(~frontier, torch.inf).flatten(-2)
        nearest, goal = lengths.min(-1)
        goal = torch.stack((goal // cells.shape[-1], goal % cells.shape[-1]), -1)
        action = first_move(free, position, goal)
        left = frontier.flatten(-2).any(-1)
        end = torch.where(left, int(Reason.NO_REACHABLE_FRONTIER), int(Reason.COVERED))
        reason = torch.where(nearest.isfinite(), int(Reason.EXPLORING), end)
        return action.where(nearest.isfinite(), F.NULL_ACTION), reason


def first_move(free: Tensor, position: Tensor, goal: Tensor) -> Tensor:
    """Gives the first action of a shortest path, ties to the lower index.

    Args:
        free: bool ``[*B, H, W]``.
        position: int64 ``[*B, 2]``.
        goal: int64 ``[*B, 2]``, reachable from ``position``.

    Returns:
        int64 ``[*B]``.
    """
    remaining = kernels.path_lengths(free, goal)
    return F.gather(remaining, F.targets(position), outside=torch.inf).argmin(-1)


class InformationGain(Planner):
    """Takes a step towards the frontier with the most information gain per path length.

    The gain is the number of unknown cells in the window around the frontier cell; it is divided by
    the path length, in moves along 8-connected known free cells, to the given power. Ties go to the
    first cell in row-major order, then to the move of the lowest index.

    Args:
        window: side of the window, cells; odd.
        power: 1: gain per move; less: farther frontiers count more; 0: gain alone.

    Raises:
        ValueError: if the window is not odd and at least 3, or the power is negative.
    """

    def __init__(self, window: int = 7, power: float = 1.0) -> None:
        if window < 3 or window % 2 == 0:
            raise ValueError(f"window={window} is not allowed: it must be odd and at least 3")
        if power < 0:
            raise ValueError(f"power={power} is not allowed: it must be 0 or more")
        super().__init__()
        self.window, self.power = window, power

    def plan(self, entries: dict[Key, Tensor], changed: Tensor) -> tuple[Tensor, Tensor]:
        """Plans one step."""
        return planning.information_gain(
            entries[K.CELLS], entries[K.POSITION], window=self.window, power=self.power
        )
