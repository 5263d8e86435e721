"""Classical planners in the same env, filter and step budget as the learned policy."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K


class RandomWalk(TensorDictModuleBase):
    """Draws every action uniformly.

    Reads ``"uniform"``, the draw, and the agent's map; writes ``"action"``.

    Args:
        feasible_only: draw among the feasible moves (staying in place if there is none) instead of
            all nine actions.
    """

    def __init__(self, feasible_only: bool = True) -> None:
        self.in_keys = [K.CELLS, K.POSITION, K.UNIFORM]
        self.out_keys = [K.ACTION]
        super().__init__()
        self.feasible_only = feasible_only

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action."""
        weight = F.feasible(tensordict[K.CELLS], tensordict[K.POSITION]).float()
        if self.feasible_only:
            weight[..., F.NULL_ACTION] = weight[..., 1:].sum(-1) == 0
        else:
            weight = torch.ones_like(weight)
        return tensordict.set(K.ACTION, F.sample_action(weight, tensordict[K.UNIFORM]))


class NearestFrontier(TensorDictModuleBase):
    """Takes a step towards the frontier with the shortest path, planning anew at every step.

    Paths lead through known free cells along 8-connected moves. Among equally near frontiers the
    first in row-major order is the goal; among equally good moves the lowest index is taken. With
    no frontier in reach the agent stays.

    Reads the agent's map; writes ``"action"``.
    """

    def __init__(self) -> None:
        self.in_keys = [K.CELLS, K.POSITION]
        self.out_keys = [K.ACTION]
        super().__init__()

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action."""
        cells, position = tensordict[K.CELLS], tensordict[K.POSITION]
        free = cells == F.Cell.FREE
        lengths = kernels.path_lengths(free, position)
        lengths = lengths.masked_fill(~F.frontier(cells), torch.inf).flatten(-2)
        nearest, goal = lengths.min(-1)
        goal = torch.stack((goal // cells.shape[-1], goal % cells.shape[-1]), -1)
        action = first_move(free, position, goal)
        return tensordict.set(K.ACTION, action.where(nearest.isfinite(), F.NULL_ACTION))


def first_move(free: torch.Tensor, position: torch.Tensor, goal: torch.Tensor) -> torch.Tensor:
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
