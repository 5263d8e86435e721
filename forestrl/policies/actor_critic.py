"""Any two networks bound to the keys they name: actor and critic for PPO, and a policy for use."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor, nn
from torch.distributions import Categorical
from torchrl.modules import ProbabilisticActor

from forestrl import functional as F
from forestrl import keys as K
from forestrl.sampling import uniform

Key = str | tuple[str, ...]


def keys_of(network: nn.Module) -> list[Key]:
    """Names what a network reads, in the order of its arguments.

    Raises:
        ValueError: if it has no ``in_keys``.
    """
    keys: Any = getattr(network, "in_keys", None)
    if not keys:
        raise ValueError(
            f"{type(network).__name__} does not say what it reads: give it in_keys, the keys of "
            "the observation in the order of forward's arguments"
        )
    return list(keys)


class Bound(TensorDictModuleBase):
    """Binds a function of tensors to keys.

    It is TensorDictModule for functions that return one tensor. The library's own allows for
    outputs that are no tensors, and for that searches the disk for another library at every call,
    which takes as long as a small network.

    Args:
        function: from tensors to one tensor.
        in_keys: what it reads, in the order of its arguments.
        out_key: what it writes.
    """

    def __init__(
        self, function: Callable[..., Tensor], in_keys: Sequence[Key], out_key: str
    ) -> None:
        super().__init__()
        self.in_keys, self.out_keys = list(in_keys), [out_key]
        self.module = function

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the result."""
        inputs = [tensordict.get(key) for key in self.in_keys]
        return tensordict.set(self.out_keys[0], self.module(*inputs))


class ActorCritic(nn.Module):
    """An actor and a critic: two networks that name what they read.

    Args:
        actor: from the tensors under its ``in_keys`` to the logits of the nine actions,
            ``[*B, 9]``.
        critic: from the tensors under its ``in_keys`` to the value of the state, ``[*B, 1]``.

    Raises:
        ValueError: if a network names no ``in_keys``.
    """

    def __init__(self, actor: nn.Module, critic: nn.Module) -> None:
        super().__init__()
        for network in (actor, critic):
            keys_of(network)
        self.actor, self.critic = actor, critic

    def make_actor(self) -> ProbabilisticActor:
        """Binds the actor for PPO: samples ``"action"`` and writes its log-probability."""
        return ProbabilisticActor(
            Bound(self.actor, keys_of(self.actor), K.LOGITS),
            in_keys=[K.LOGITS],
            distribution_class=Categorical,
            distribution_kwargs={"validate_args": False},  # saves 3 % of a minibatch
            return_log_prob=True,
        )

    def make_critic(self) -> Bound:
        """Binds the critic for PPO: writes ``"state_value"``."""
        return Bound(self.critic, keys_of(self.critic), "state_value")

    def make_policy(self, deterministic: bool | None = None) -> LearnedPolicy:
        """Binds the actor for use.

        Args:
            deterministic: take the most probable action instead of a sampled one, as None means.
        """
        return LearnedPolicy(self.actor, bool(deterministic))


class LearnedPolicy(TensorDictModuleBase):
    """Decides by the logits of an actor; writes ``"logits"`` and ``"action"``.

    Sampling takes the draws under ``"uniform"`` if there are any, else torch's generator.

    Args:
        actor: from the tensors under its ``in_keys`` to logits, ``[*B, 9]``.
        deterministic: take the most probable action instead of a sampled one.
    """

    def __init__(self, actor: nn.Module, deterministic: bool = False) -> None:
        super().__init__()
        self.in_keys, self.out_keys = keys_of(actor), [K.LOGITS, K.ACTION]
        self.actor, self.deterministic = actor, deterministic
        self.file: Any = None
        """The policy file it is out of, if it is."""

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes logits and action.

        Raises:
            ValueError: if a logit is not finite, as of weights that are broken.
        """
        logits = self.actor(*[tensordict.get(key) for key in self.in_keys])
        if not logits.isfinite().all():
            raise ValueError("the policy's outputs are not finite: its weights are broken")
        if self.deterministic:
            action = logits.argmax(-1)
        else:
            action = F.sample_action(torch.softmax(logits.double(), -1), uniform(tensordict))
        tensordict.set(K.LOGITS, logits)
        return tensordict.set(K.ACTION, action)
