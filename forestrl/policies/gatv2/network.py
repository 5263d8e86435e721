"""The policy's and the critic's network: two GATv2 layers over the exploration graph (Table II)."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import torch
from torch import Tensor, nn
from torch_geometric.nn import GATv2Conv

from forestrl import functional as F
from forestrl import keys as K
from forestrl.kernels.dispatch import by_device
from forestrl.policies.actor_critic import ActorCritic
from forestrl.policies.gatv2.encoder import compiles, gatv2_encoder
from forestrl.settings import Range, checked

Kernel = Literal["fused", "pyg"]
Readout = Literal["mean", "concat"]


class GATv2Encoder(nn.Module):
    r"""Encodes an exploration graph into one number per action (Table II).

    Two GATv2 layers with edge lengths, ``8 -> hidden``, ``heads`` heads concatenated, ReLU, then
    ``heads * hidden -> 1`` with one head. Each layer computes, for node ``i`` and its in-edges
    ``j -> i``, the self-loop among them,

    .. math::
        e_{ij} &= a^\top \mathrm{LeakyReLU}(W_l x_j + W_r x_i + w_e d_{ij}) & \text{(Eq. 3)} \\
        \alpha_{ij} &= \exp(e_{ij}) / \sum_k \exp(e_{ik}) & \text{(Eq. 4)} \\
        x'_i &= \sum_j \alpha_{ij} W_l x_j + b & \text{(Eq. 5)}

    with ``d_ij`` the edge's length in units of ``l``. The outputs of nodes 0 to 8, the agent and
    its waypoints, are the actor's logits for actions 0 to 8.

    Args:
        hidden: channels per head of layer 1.
        heads: attention heads of layer 1.
        kernel: ``"fused"`` computes CPU tensors with :mod:`forestrl.policies.gatv2.passes`, which
            has no gradient for ``x``; ``"pyg"``, and ``"fused"`` on other devices, with PyTorch
            Geometric. Both have the same parameters and results.
        lidar_range: ``l``, cells, the unit of edge lengths.
        edge_lengths: whether the attention reads them; without, every edge counts as of length 0.
    """

    in_keys = K.GRAPH

    @checked
    def __init__(
        self,
        hidden: Annotated[int, Range(1, 1024)] = 16,
        heads: Annotated[int, Range(1, 64)] = 4,
        kernel: Kernel = "fused",
        lidar_range: float = 5.0,
        edge_lengths: bool = True,
    ) -> None:
        super().__init__()
        self.kernel = "fused" if kernel == "fused" and compiles(heads * hidden) else "pyg"
        self.lidar_range = lidar_range if edge_lengths else math.inf  # the fixed edges' become 0
        self.edge_lengths = edge_lengths
        self.conv1 = GATv2Conv(F.FEATURES, hidden, heads=heads, edge_dim=1, add_self_loops=False)
        self.conv2 = GATv2Conv(heads * hidden, 1, edge_dim=1, add_self_loops=False)

    def forward(self, x: Tensor, waypoint: Tensor, length: Tensor, frontiers: Tensor) -> Tensor:
        """Computes the outputs of nodes 0 to 8.

        Args:
            x: node features, ``[*B, 9 + M, 8]``.
            waypoint: the waypoint each frontier is tied to, int64 ``[*B, M]``.
            length: the length of that edge in units of ``l``, ``[*B, M]``.
            frontiers: the number of frontiers, int64 ``[*B, 1]``.

        Returns:
            ``[*B, 9]``.
        """
        if not self.edge_lengths:
            length = torch.zeros_like(length)
        encode = _fused if self.kernel == "fused" else _pyg
        return encode(x, waypoint, length, frontiers, self)


def _compiled(
    x: Tensor, waypoint: Tensor, length: Tensor, frontiers: Tensor, network: GATv2Encoder
) -> Tensor:
    """Runs the compiled passes."""
    return gatv2_encoder(
        x, waypoint, length, frontiers, network.conv1, network.conv2,
        lidar_range=network.lidar_range,
    )  # fmt: skip


def _pyg(
    x: Tensor, waypoint: Tensor, length: Tensor, frontiers: Tensor, network: GATv2Encoder
) -> Tensor:
    """Runs PyTorch Geometric on the batch as one graph, without the padding none uses."""
    batch, room = x.shape[:-2], _used(frontiers, waypoint.shape[-1])
    waypoint, length = waypoint[..., :room], length[..., :room]
    edge_index, edge_attr = F.edges(waypoint, length, frontiers, lidar_range=network.lidar_range)
    nodes = F.WAYPOINTS + room
    x = x[..., :nodes, :].reshape(-1, F.FEATURES)
    edge_index = edge_index.reshape(-1, *edge_index.shape[-2:])  # (B, 2, E)
    offset = nodes * torch.arange(len(edge_index), device=x.device)
    edge_index = (edge_index + offset[:, None, None]).transpose(0, 1).flatten(1)
    edge_attr = edge_attr.reshape(-1, 1)
    hidden = network.conv1(x, edge_index, edge_attr).relu()
    out = network.conv2(hidden, edge_index, edge_attr)
    return out.view(*batch, nodes)[..., : F.WAYPOINTS]


def _used(frontiers: Tensor, room: int) -> int:
    """Gives the room for frontiers that some graph needs."""
    if frontiers.numel() == 0:
        return 0
    try:
        return min(room, int(frontiers.max()))
    except RuntimeError:  # under vmap, as in TorchRL's GAE, no shape may depend on data
        return room


_fused = by_device(_compiled, _pyg)


class Critic(nn.Module):
    """Estimates a state's value from the nine outputs of an encoder (Table II).

    Args:
        encoder: maps what its ``in_keys`` name to ``[*B, 9]``; a network of the critic's own.
        readout: how the nine outputs are aggregated before the fully connected layer: ``"mean"``
            to ``[*B, 1]``, or ``"concat"`` to ``[*B, 9]``.
    """

    @checked
    def __init__(self, encoder: nn.Module, readout: Readout = "mean") -> None:
        super().__init__()
        self.encoder = encoder
        self.in_keys = encoder.in_keys
        self.readout = readout
        self.linear = nn.Linear(F.WAYPOINTS if readout == "concat" else 1, 1)

    def forward(self, *observation: Tensor) -> Tensor:
        """Estimates the value ``[*B, 1]`` from what the encoder takes."""
        outputs = self.encoder(*observation)
        if self.readout == "mean":
            outputs = outputs.mean(-1, keepdim=True)
        return self.linear(outputs)


class GATv2ActorCritic(ActorCritic):
    """The two networks of Table II, of the same shape and with their own weights.

    Args:
        hidden: channels a head of the first layer (Table II).
        heads: attention heads of the first layer (Table II).
        critic_readout: how the critic aggregates the nine outputs.
        kernel: ``fused``, compiled for the CPU, or ``pyg``, PyTorch Geometric's layers.
        lidar_range: ``l``, cells, the unit of edge lengths.
        edge_lengths: whether the attention reads them.
    """

    adjustable = ("kernel", "lidar_range")
    """Settings that the weights do not depend on."""

    @checked
    def __init__(
        self,
        hidden: Annotated[int, Range(1, 1024)] = 16,
        heads: Annotated[int, Range(1, 64)] = 4,
        critic_readout: Readout = "mean",
        kernel: Kernel = "fused",
        lidar_range: Annotated[float, Range(1.415, 100)] = 5.0,
        edge_lengths: bool = True,
    ) -> None:
        def encoder() -> GATv2Encoder:
            return GATv2Encoder(hidden, heads, kernel, lidar_range, edge_lengths)

        super().__init__(encoder(), Critic(encoder(), readout=critic_readout))
