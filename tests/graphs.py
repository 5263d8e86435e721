"""The library's graphs told by cells, so that they can be compared whatever their node order."""

from __future__ import annotations

import torch
from torch import Tensor

from forestrl import functional as F
from tests.oracles import Edges, Node


def nodes_of(graph: F.Graph, cells: Tensor, position: Tensor) -> list[Node]:
    """The nodes in the library's order: agent, eight waypoints, frontiers nearest first."""
    capacity = graph.waypoint.shape[-1]
    frontiers, count = F.nearest_first(F.frontier(cells), position, capacity)
    core = (position + F.DISPLACEMENTS).tolist()
    leaves = frontiers[: min(int(count), capacity)].tolist()
    return [(i, row, col) for i, (row, col) in enumerate(core)] + [(9, *leaf) for leaf in leaves]


def features_by_node(graph: F.Graph, cells: Tensor, position: Tensor) -> dict[Node, list[float]]:
    """Features ``x`` by node; the padding is left out."""
    nodes = nodes_of(graph, cells, position)
    return dict(zip(nodes, graph.x[: len(nodes)].tolist(), strict=True))


def edges_by_node(graph: F.Graph, cells: Tensor, position: Tensor, *, lidar_range: float) -> Edges:
    """Lengths by (source, target); padded nodes must have nothing but loops of length 0."""
    nodes = nodes_of(graph, cells, position)
    index, length = F.edges(graph.waypoint, graph.length, graph.frontiers, lidar_range=lidar_range)
    padding = (index >= len(nodes)).any(0)
    assert torch.equal(index[0, padding], index[1, padding])
    assert not length[padding].any()
    pairs = index[:, ~padding].T.tolist()
    assert len(pairs) == len({tuple(pair) for pair in pairs}), "an edge is stored twice"
    lengths = length[~padding, 0].tolist()
    return {(nodes[s], nodes[t]): x for (s, t), x in zip(pairs, lengths, strict=True)}
