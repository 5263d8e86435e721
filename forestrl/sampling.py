"""The draws that stochastic policies sample their actions with."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torch import Tensor

from forestrl import keys as K


def uniform(tensordict: TensorDictBase) -> Tensor:
    """Gives one draw from [0, 1) an arena.

    Args:
        tensordict: evaluation puts its own draws under ``"uniform"``, so that they depend on seed
            and arena only; without them, as in ``env.rollout``, torch's generator is asked.

    Returns:
        float32 ``[*B]``.
    """
    draws = tensordict.get(K.UNIFORM, None)
    return torch.rand(tensordict.batch_size, device=tensordict.device) if draws is None else draws
