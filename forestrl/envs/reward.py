"""The reward with the frontier potential as a transform (Eqs. 6 to 9)."""

from __future__ import annotations

from typing import Annotated

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.data import Bounded, Composite, Unbounded
from torchrl.envs.transforms import Compose, Transform

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.envs.asking import setting_of
from forestrl.envs.graph import WINDOW, ExplorationGraph, Window
from forestrl.settings import Range, checked


class FrontierPotentialReward(Transform):
    """Shapes the reward with the change of the frontier potential (Eqs. 6 to 9).

    Writes ``("exploration", "potential")`` float32 ``[*B, 1]``, ``Phi(s)``, and replaces
    ``"reward"``. An action counts as unsafe if the filter replaced it or if, without a filter, it
    collided.

    Args:
        beta: weight of the information gain against the distance.
        window: ``k``, side of the window the gain is counted in, cells; odd. ``None`` for that of
            the graph in the same env, which is 7 unless it says otherwise.
        coverage_goal: ``rho*``, the coverage that earns ``r_explored``; ``None`` for the env's own.
        r_explored: ``r_exp``.
        r_unsafe: ``r_sigma``.
        shaping: whether the change of the potential is added; without it the potential is only
            reported.

    Raises:
        ValueError: if ``beta`` is negative, or ``window`` even or not positive.
    """

    @checked
    def __init__(
        self,
        beta: Annotated[float, Range(0, 1000)] = 0.5,
        window: Window | None = None,
        coverage_goal: Annotated[float, Range(above=0, high=1)] | None = None,
        r_explored: Annotated[float, Range(-1_000_000, 1_000_000)] = 100.0,
        r_unsafe: Annotated[float, Range(-1_000_000, 1_000_000)] = -5.0,
        shaping: bool = True,
    ) -> None:
        super().__init__(in_keys=[K.CELLS, K.POSITION, "reward"], out_keys=[K.POTENTIAL, "reward"])
        self.beta, self.window, self.coverage_goal = beta, window, coverage_goal
        self.r_explored, self.r_unsafe, self.shaping = r_explored, r_unsafe, shaping

    def _potential(self, tensordict: TensorDictBase) -> Tensor:
        return kernels.potential(
            tensordict[K.CELLS],
            tensordict[K.POSITION],
            window=self._window_of_the_graph() if self.window is None else self.window,
            beta=self.beta,
        )

    def _window_of_the_graph(self) -> int:
        beside = getattr(self.container, "transform", self)
        beside = beside if isinstance(beside, Compose) else [beside]
        graphs = [each for each in beside if isinstance(each, ExplorationGraph)]
        return graphs[0].window if graphs else WINDOW

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        tensordict_reset[K.POTENTIAL] = self._potential(tensordict_reset)
        return tensordict_reset

    def _step(self, tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> TensorDictBase:
        potential = tensordict.get(K.POTENTIAL, None)
        if potential is None:  # stepped from a situation that was written down, not reset
            potential = self._potential(tensordict)
        next_tensordict[K.POTENTIAL] = self._potential(next_tensordict)
        next_tensordict["reward"] = F.reward(
            next_tensordict[K.NEW_CELLS],
            potential,
            next_tensordict[K.POTENTIAL] if self.shaping else potential,
            explored=next_tensordict[K.COVERAGE] >= setting_of(self, "coverage_goal"),
            unsafe=next_tensordict[K.COLLISION] | self._intervened(tensordict, next_tensordict),
            r_explored=self.r_explored,
            r_unsafe=self.r_unsafe,
        )
        return next_tensordict

    @staticmethod
    def _intervened(tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> Tensor:
        """Whether a filter replaced the action, be it before or behind this transform or inside."""
        if (proposed := tensordict.get(K.PROPOSED, None)) is not None:
            return (proposed != tensordict[K.ACTION]).unsqueeze(-1)
        return next_tensordict.get(K.INTERVENED, torch.zeros_like(next_tensordict[K.COLLISION]))

    def metrics(self, batch: TensorDictBase) -> dict[str, float]:
        """Splits the mean reward of a batch of experience into Eq. 6's terms; they add up to it."""
        after = batch["next"]
        none = torch.zeros_like(after[K.COLLISION])
        unsafe = after.get(K.INTERVENED, none) | after[K.COLLISION]
        explored = (after[K.COVERAGE] >= setting_of(self, "coverage_goal")) & ~unsafe
        shaped = (~unsafe & ~explored).float()
        new_cells = after[K.NEW_CELLS] * shaped
        terms = {
            "new_cells": new_cells,
            "potential": after["reward"] * shaped - new_cells,
            "explored": after["reward"] * explored,
            "unsafe": after["reward"] * unsafe,
        }
        return {f"reward/{name}": float(term.float().mean()) for name, term in terms.items()}

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Declares the potential."""
        observation_spec[K.POTENTIAL] = Bounded(
            0.0, 1.0, shape=(*observation_spec.shape, 1), device=observation_spec.device
        )
        return observation_spec

    def transform_reward_spec(self, reward_spec: Composite) -> Composite:
        """Declares the reward unbounded."""
        for key in reward_spec.keys(True, True):
            reward_spec[key] = Unbounded(shape=reward_spec[key].shape, device=reward_spec.device)
        return reward_spec
