"""The planner that goes to the nearest frontier."""

from __future__ import annotations

import torch
from torch import Tensor

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.planners.base import ClassicalPlanner, Key
from forestrl.status import Status


class NearestFrontier(ClassicalPlanner):
    """Takes a step towards the frontier with the shortest path, planning anew at every step.

    Paths lead through known free cells along 8-connected moves. Among equally near frontiers the
    first in row-major order is the goal; among equally good moves the lowest index is taken. With
    no frontier in reach the agent stays.
    """

    def __init__(self) -> None:
        super().__init__(remembers=[K.TARGET])

    def plan(self, entries: dict[Key, Tensor], changed: Tensor) -> tuple[Tensor, Tensor]:
        """Plans one step."""
        cells, position = entries[K.CELLS], entries[K.POSITION]
        free, frontier = cells == F.Cell.FREE, F.frontier(cells)
        lengths = kernels.path_lengths(free, position)
        lengths = lengths.masked_fill(~frontier, torch.inf).flatten(-2)
        nearest, goal = lengths.min(-1)
        goal = torch.stack((goal // cells.shape[-1], goal % cells.shape[-1]), -1)
        entries[K.TARGET] = goal.where(nearest.isfinite().unsqueeze(-1), -1)
        action = first_move(free, position, goal)
        left = frontier.flatten(-2).any(-1)
        end = torch.where(left, int(Status.NO_REACHABLE_FRONTIER), int(Status.COVERED))
        status = torch.where(nearest.isfinite(), int(Status.EXPLORING), end)
        return action.where(nearest.isfinite(), F.NULL_ACTION), status


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
