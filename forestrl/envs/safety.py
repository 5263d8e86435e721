"""The safety filter as a transform (Algorithm 1)."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.data import Binary, Categorical, Composite
from torchrl.envs.transforms import Transform

from forestrl import functional as F
from forestrl import keys as K


class SafetyFilter(Transform):
    """Replaces an infeasible action by the nearest feasible one (Algorithm 1).

    On the way in, ``"action"`` becomes ``u^sigma`` for the env while the root TensorDict keeps the
    policy's ``u^pi``, so that log-probabilities and the loss see what the policy chose. On the way
    out it reports what was done.

    Writes ``("safety", "feasible")`` bool ``[*B, 9]``, which actions are feasible from here;
    ``("safety", "executed")`` int64 ``[*B]``, ``u^sigma``; and ``("safety", "intervened")`` bool
    ``[*B, 1]``, ``u^sigma != u^pi``.
    """

    def __init__(self) -> None:
        super().__init__(
            in_keys=[K.CELLS, K.POSITION],
            out_keys=[K.FEASIBLE, K.EXECUTED, K.INTERVENED],
            in_keys_inv=[K.ACTION],
            out_keys_inv=[K.ACTION],
        )

    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        proposed = tensordict[K.ACTION]
        F.check_action(proposed)
        feasible = F.feasible(tensordict[K.CELLS], tensordict[K.POSITION])
        # Set, never written in place: the root shares these tensors.
        tensordict[K.PROPOSED] = proposed
        tensordict[K.ACTION] = F.safe_action(proposed, feasible)
        return tensordict

    def _step(self, tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> TensorDictBase:
        executed = tensordict[K.ACTION]  # u^sigma: this tensordict has been through _inv_call
        return self._report(next_tensordict, executed, executed != tensordict[K.PROPOSED])

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        null = tensordict_reset[K.POSITION][..., 0].new_full(
            tensordict_reset.batch_size, F.NULL_ACTION
        )
        return self._report(tensordict_reset, null, torch.zeros_like(null, dtype=torch.bool))

    def _report(
        self, tensordict: TensorDictBase, executed: Tensor, intervened: Tensor
    ) -> TensorDictBase:
        tensordict[K.FEASIBLE] = F.feasible(tensordict[K.CELLS], tensordict[K.POSITION])
        tensordict[K.EXECUTED] = executed
        tensordict[K.INTERVENED] = intervened.unsqueeze(-1)
        return tensordict

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Declares the three keys.

        Raises:
            ValueError: if a reward inside the env could not see what is replaced out here.
        """
        inside = getattr(self.container, "base_env", None)
        if inside is not None and K.POTENTIAL in inside.observation_spec.keys(True, True):
            raise ValueError(
                "a FrontierPotentialReward inside the env does not see what a SafetyFilter outside "
                "replaces: put both inside or both outside"
            )
        b, n, device = observation_spec.shape, len(F.DISPLACEMENTS), observation_spec.device
        observation_spec[K.FEASIBLE] = Binary(shape=(*b, n), dtype=torch.bool, device=device)
        observation_spec[K.EXECUTED] = Categorical(n, shape=b, device=device)
        observation_spec[K.INTERVENED] = Binary(shape=(*b, 1), dtype=torch.bool, device=device)
        return observation_spec

    def metrics(self, batch: TensorDictBase) -> dict[str, float]:
        """Measures a batch of experience: the share of steps whose action was replaced."""
        return {"safety/intervention_rate": float(batch["next", K.INTERVENED].float().mean())}
