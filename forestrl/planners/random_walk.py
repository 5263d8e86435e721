"""The random walk."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase

from forestrl import functional as F
from forestrl import keys as K
from forestrl.sampling import uniform
from forestrl.settings import checked


class RandomWalk(TensorDictModuleBase):
    """Draws every action uniformly.

    Reads the agent's map and, if there is one, the draw under ``"uniform"``; writes ``"action"``.

    Args:
        feasible_only: draw among the feasible moves (staying in place if there is none) instead of
            all nine actions.
    """

    @checked
    def __init__(self, feasible_only: bool = True) -> None:
        self.in_keys = [K.CELLS, K.POSITION]
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
        return tensordict.set(K.ACTION, F.sample_action(weight, uniform(tensordict)))
