"""The networks of the explorer: a linear score of viewpoints, and a GATv2 that adds to it."""

from __future__ import annotations

from typing import Annotated, Any

import torch
from torch import Tensor, nn

from forestrl.explorer.compiled import EDGES, NEGATIVE_SLOPE, Weights
from forestrl.explorer.features import FEATURES
from forestrl.explorer.policy import ViewpointPolicy
from forestrl.planners.viewpoints.scores import TERMS
from forestrl.settings import Range, checked

PATH_GAIN = (1.4, *[0.0] * (len(TERMS) - 1))
"""The weights with which the linear score is the logarithm of path gain."""


class LinearScore(nn.Module):
    """A linear function of fourteen terms: goes to the cell where it is largest.

    Args:
        lidar_range: sensor range ``l``, cells; the env's.
        coverage_goal: the coverage to be reached; the env's. Not looked at.

    Attributes:
        weights: of the :data:`TERMS`, ``[14]``; at first those of path gain.
    """

    adjustable = ("lidar_range", "coverage_goal")
    """Settings that the weights do not depend on."""
    weights: Tensor

    @checked
    def __init__(
        self,
        lidar_range: Annotated[float, Range(1.415, 100)] = 5.0,
        coverage_goal: Annotated[float, Range(above=0, high=1)] = 0.98,
    ) -> None:
        super().__init__()
        self.lidar_range, self.coverage_goal = lidar_range, coverage_goal
        self.register_buffer("weights", torch.tensor(PATH_GAIN, dtype=torch.float64))

    def pack(self) -> Weights:
        """Gives the weights as the compiled code takes them."""
        return pack(self.weights, 1)

    def make_policy(self, deterministic: bool | None = None) -> ViewpointPolicy:
        """Makes the policy; see :class:`ViewpointPolicy`."""
        return ViewpointPolicy(self.pack(), self.lidar_range, self.coverage_goal, deterministic)


class _Layer(nn.Module):
    """One GATv2 layer over a complete graph, self-loops included (Eqs. 3 to 5)."""

    def __init__(self, heads: int, hidden: int) -> None:
        super().__init__()
        channels = heads * hidden
        self.left, self.right = nn.Linear(channels, channels), nn.Linear(channels, channels)
        self.edge = nn.Linear(EDGES, channels, bias=False)
        self.attention = nn.Parameter(torch.empty(heads, hidden))
        nn.init.normal_(self.attention, std=0.3)

    def forward(self, x: Tensor, edges: Tensor, there: Tensor) -> Tensor:
        """Attends: ``x`` ``[B, M, C]``, edges ``[B, M, M, 3]``, nodes that are there ``[B, M]``."""
        shape = (*x.shape[:2], *self.attention.shape)
        left, right = self.left(x).view(shape), self.right(x).view(shape)
        edge = self.edge(edges).view(*edges.shape[:3], *self.attention.shape)
        hidden = left.unsqueeze(1) + right.unsqueeze(2) + edge  # [B, target, source, heads, hidden]
        logits = (nn.functional.leaky_relu(hidden, NEGATIVE_SLOPE) * self.attention).sum(-1)
        share = logits.masked_fill(~there[:, None, :, None], -torch.inf).softmax(2)
        return torch.einsum("btsk,bskh->btkh", share, left).flatten(-2)


class ViewpointGATv2(nn.Module):
    """Compares viewpoints with one another; what it says is added to their linear scores.

    The graph is complete: nodes are the candidates, at most ``candidates`` of them, with
    :data:`FEATURES`; edges say how far apart they are. Before training nothing is added.

    Args:
        lidar_range: sensor range ``l``, cells; the env's.
        coverage_goal: the coverage to be reached; the env's.
        candidates: how many viewpoints are compared, ``M``.
        hidden: channels per head.
        heads: attention heads.
        layers: of attention.
    """

    adjustable = ("lidar_range", "coverage_goal")
    """Settings that the weights do not depend on."""
    linear: Tensor
    mean: Tensor
    scale: Tensor

    @checked
    def __init__(
        self,
        lidar_range: Annotated[float, Range(1.415, 100)] = 5.0,
        coverage_goal: Annotated[float, Range(above=0, high=1)] = 0.98,
        candidates: Annotated[int, Range(2, 64)] = 10,
        hidden: Annotated[int, Range(1, 256)] = 8,
        heads: Annotated[int, Range(1, 64)] = 4,
        layers: Annotated[int, Range(1, 8)] = 1,
    ) -> None:
        super().__init__()
        self.lidar_range, self.coverage_goal = lidar_range, coverage_goal
        self.candidates = candidates
        self.register_buffer("linear", torch.tensor(PATH_GAIN, dtype=torch.float64))
        self.register_buffer("mean", torch.zeros(len(FEATURES), dtype=torch.float64))
        self.register_buffer("scale", torch.ones(len(FEATURES), dtype=torch.float64))
        self.embed = nn.Linear(len(FEATURES), heads * hidden)
        self.layers = nn.ModuleList(_Layer(heads, hidden) for _ in range(layers))
        self.out = nn.Linear(heads * hidden, 1, bias=False)
        self.skip = nn.Linear(len(FEATURES), 1, bias=False)
        for last in (self.out, self.skip):
            nn.init.zeros_(last.weight)

    def forward(self, features: Tensor, places: Tensor, there: Tensor) -> Tensor:
        """Scores the candidates.

        Args:
            features: float64 ``[B, M, F]``.
            places: row and column, cells, ``[B, M, 2]``.
            there: which of them there are, bool ``[B, M]``.

        Returns:
            the scores, ``[B, M]``.
        """
        nodes = ((features - self.mean) / self.scale).float()
        away = (places.unsqueeze(1) - places.unsqueeze(2)).abs().amax(-1)
        distance = away.float() / (2 * self.lidar_range)  # whole cells first: 0.6 is exact
        edges = torch.stack((distance, (-2 * distance).exp(), (distance < 0.6).float()), -1)
        x = self.embed(nodes).relu()
        for layer in self.layers:
            x = (x + layer(x, edges, there)).relu()
        added = (self.out(x) + self.skip(nodes)).squeeze(-1)
        return features[..., len(TERMS)].float() + added

    def pack(self) -> Weights:
        """Gives the weights as the compiled code takes them."""
        return pack(self.linear, self.candidates, self)

    def make_policy(self, deterministic: bool | None = None) -> ViewpointPolicy:
        """Makes the policy; see :class:`ViewpointPolicy`."""
        return ViewpointPolicy(self.pack(), self.lidar_range, self.coverage_goal, deterministic)


def pack(linear: Tensor, most: int, network: ViewpointGATv2 | None = None) -> Weights:
    """Gives weights as the compiled code takes them.

    Args:
        linear: of the linear score, ``[14]``.
        most: how many candidates are compared.
        network: what is added to the score; None for nothing.
    """
    if network is None:
        network = ViewpointGATv2(hidden=1, heads=1)

    def array(value: Tensor) -> Any:
        return value.detach().cpu().contiguous().numpy()

    def stacked(values: list[Tensor]) -> Any:
        return array(torch.stack(values))

    layers: list[Any] = list(network.layers)
    return Weights(
        linear=array(linear),
        most=most,
        mean=array(network.mean),
        scale=array(network.scale),
        skip=array(network.skip.weight[0]),
        embed=array(network.embed.weight.T),
        embed_bias=array(network.embed.bias),
        left=stacked([layer.left.weight.T for layer in layers]),
        left_bias=stacked([layer.left.bias for layer in layers]),
        right=stacked([layer.right.weight.T for layer in layers]),
        right_bias=stacked([layer.right.bias for layer in layers]),
        edge=stacked([layer.edge.weight.T for layer in layers]),
        attention=stacked([layer.attention for layer in layers]),
        out=array(network.out.weight[0]),
    )
