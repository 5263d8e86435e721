"""The GATv2 networks bound to their keys: actor and critic for PPO, and the policy for use."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModule, TensorDictSequential
from torch import Tensor, nn
from torch.distributions import Categorical
from torchrl.modules import ProbabilisticActor

from forestrl import functional as F
from forestrl import keys as K
from forestrl.policies.gatv2.network import Critic, GATv2Encoder, Kernel, Readout


class Bound(TensorDictModule):
    """Binds a function of tensors to keys, as its parent does, but without looking at the outputs.

    The parent allows for outputs that are no tensors, and for that searches the disk for another
    library at every call, which takes as long as a small network.
    """

    def _write_to_tensordict(
        self,
        tensordict: TensorDictBase,
        tensors: Iterable[Tensor],
        tensordict_out: TensorDictBase | None = None,
        out_keys: Iterable[str] | None = None,
    ) -> TensorDictBase:
        written = tensordict if tensordict_out is None else tensordict_out
        for key, value in zip(out_keys or self.out_keys, tensors, strict=True):
            written.set(key, value)
        return written


class ActorCritic(nn.Module):
    """The two networks of Table II, of the same shape and with their own weights.

    Args:
        hidden: channels a head of the first layer (Table II).
        heads: attention heads of the first layer (Table II).
        critic_readout: how the critic aggregates the nine outputs.
        kernel: ``fused``, compiled for the CPU, or ``pyg``, PyTorch Geometric's layers.
        lidar_range: ``l``, cells, the unit of edge lengths.
        edge_lengths: whether the attention reads them.
    """

    def __init__(
        self,
        hidden: int = 16,
        heads: int = 4,
        critic_readout: Readout = "mean",
        kernel: Kernel = "fused",
        lidar_range: float = 5.0,
        edge_lengths: bool = True,
    ) -> None:
        super().__init__()

        def encoder() -> GATv2Encoder:
            return GATv2Encoder(hidden, heads, kernel, lidar_range, edge_lengths)

        self.actor = encoder()
        self.critic = Critic(encoder(), readout=critic_readout)

    def make_actor(self) -> ProbabilisticActor:
        """Binds the actor for PPO: samples ``"action"`` and writes its log-probability."""
        return ProbabilisticActor(
            Bound(self.actor, in_keys=list(K.GRAPH), out_keys=[K.LOGITS]),
            in_keys=[K.LOGITS],
            distribution_class=Categorical,
            distribution_kwargs={"validate_args": False},  # saves 3 % of a minibatch
            return_log_prob=True,
        )

    def make_critic(self) -> TensorDictModule:
        """Binds the critic for PPO: writes ``"state_value"``."""
        return Bound(self.critic, in_keys=list(K.GRAPH), out_keys=["state_value"])

    def make_policy(self, deterministic: bool = False) -> TensorDictSequential:
        """Binds the policy for use: writes ``"logits"`` and ``"action"``.

        Args:
            deterministic: take the most probable action instead of sampling with ``"uniform"``.
        """
        choose = (
            Bound(_mode, in_keys=[K.LOGITS], out_keys=[K.ACTION])
            if deterministic
            else Bound(_sample, in_keys=[K.LOGITS, K.UNIFORM], out_keys=[K.ACTION])
        )
        network = Bound(self.actor, in_keys=list(K.GRAPH), out_keys=[K.LOGITS])
        return TensorDictSequential(network, choose)


def _mode(logits: Tensor) -> Tensor:
    return logits.argmax(-1)


def _sample(logits: Tensor, uniform: Tensor) -> Tensor:
    return F.sample_action(torch.softmax(logits.double(), -1), uniform)
