"""What training does to episodes and evaluation does not."""

from __future__ import annotations

from typing import Annotated

import torch
from tensordict import TensorDictBase
from torchrl.data import Bounded, Composite
from torchrl.envs.transforms import Transform

from forestrl import keys as K
from forestrl.settings import Range, checked

_HORIZON = "horizon"


class StaggeredEpisodes(Transform):
    """Cuts training episodes, the first ones at staggered times.

    An episode is truncated after ``steps`` steps, by default the env's own budget; the first
    episode of every arena is cut at a time drawn uniformly, so that the arenas of a batch are in
    all phases of exploration from the start. The horizon travels in the TensorDict under
    ``"horizon"``, int64 ``[*B, 1]``.

    Args:
        steps: length of a training episode.

    The first horizons follow from the env's seed.

    Raises:
        ValueError: if ``steps`` is less than 1.
    """

    @checked
    def __init__(self, steps: Annotated[int, Range(1, 1_000_000_000)] = 500) -> None:
        super().__init__(in_keys=[K.STEP_COUNT], out_keys=[_HORIZON])
        self.steps = steps

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        horizon = torch.full_like(tensordict_reset[K.STEP_COUNT], self.steps)
        if tensordict is None or "_reset" not in tensordict.keys():
            horizon = self._first(horizon.shape).to(horizon.device)
        tensordict_reset[_HORIZON] = horizon
        return tensordict_reset

    def _first(self, shape: torch.Size) -> torch.Tensor:
        """Draws the first horizons: a function of the env's seed alone, without a state."""
        source = self.container.base_env.rng
        source = source[0] if isinstance(source, list) else source  # of several envs side by side
        generator = torch.Generator().manual_seed(source.initial_seed())
        return torch.randint(1, self.steps + 1, shape, generator=generator)

    def _step(self, tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> TensorDictBase:
        horizon = tensordict[_HORIZON]
        cut = next_tensordict["truncated"] | (next_tensordict[K.STEP_COUNT] >= horizon)
        next_tensordict[_HORIZON] = horizon
        next_tensordict["truncated"] = cut
        next_tensordict["done"] = next_tensordict["terminated"] | cut
        return next_tensordict

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Declares the horizon."""
        observation_spec[_HORIZON] = Bounded(
            1,
            self.steps,
            shape=(*observation_spec.shape, 1),
            dtype=torch.int64,
            device=observation_spec.device,
        )
        return observation_spec
