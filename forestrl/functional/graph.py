"""The exploration graph: nodes, features and edges (Eqs. 1 and 2)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from forestrl.functional.actions import DISPLACEMENTS, feasible, targets
from forestrl.functional.frontier import frontier, nearest_first
from forestrl.functional.grid import Cell, window_counts_at

WAYPOINTS = len(DISPLACEMENTS)
"""Node 0 is the agent, nodes 1 to 8 its waypoints in Table I's order: node i is action i."""

FEATURES = 8
"""One-hot {agent, traversable, non-traversable, frontier}, then the shares of free, unknown,
occupied and frontier cells in the window."""

_PAIRS = (DISPLACEMENTS[:, None] - DISPLACEMENTS).abs().amax(-1)
WAYPOINT_EDGES = ((_PAIRS <= 1).fill_diagonal_(False)).nonzero().T.contiguous()
"""The fixed edges among agent and waypoints: the agent's to each, and Eq. 1's; int64 ``[2, 40]``.
Every waypoint is within Chebyshev distance 1 of the agent, so that one rule gives both."""


class Graph(NamedTuple):
    """An exploration graph in padded form; :func:`edges` writes its edges out."""

    x: Tensor
    """Node features, float32 ``[*B, 9 + M, 8]``; zeros in the padding."""
    waypoint: Tensor
    """The waypoint each frontier is tied to (Eq. 2), 1 to 8, int64 ``[*B, M]``; 0 in padding."""
    length: Tensor
    """The length of that edge in units of ``l``, float32 ``[*B, M]``; 0 in the padding."""
    frontiers: Tensor
    """How many frontier cells there are, int64 ``[*B, 1]``; more than ``M`` if cut off."""


def exploration_graph(
    cells: Tensor, position: Tensor, *, window: int, max_frontiers: int, lidar_range: float
) -> Graph:
    """Builds the exploration graph of the agent's map.

    Nodes are the agent, the eight neighbouring cells in Table I's order and the frontier cells,
    nearest first. The window counts are divided by ``k^2``; cells outside the arena count as
    occupied; a frontier cell counts as free and as frontier.

    Args:
        cells: the agent's map, uint8 ``[*B, H, W]``.
        position: int64 ``[*B, 2]``.
        window: ``k``, odd, cells.
        max_frontiers: ``M``, room for frontier nodes; the nearest are kept.
        lidar_range: ``l``, cells, the unit of edge lengths.

    Returns:
        the graph.
    """
    is_frontier = frontier(cells)
    frontiers, count = nearest_first(is_frontier, position, max_frontiers)
    listed = torch.arange(max_frontiers, device=cells.device) < count.unsqueeze(-1)
    nodes = torch.cat((targets(position), frontiers), -2)  # (*B, 9 + M, 2)
    free, unknown, border = (
        window_counts_at(mask, nodes, window)
        for mask in (cells == Cell.FREE, cells == Cell.UNKNOWN, is_frontier)
    )
    counts = torch.stack((free, unknown, window**2 - free - unknown, border), -1) / window**2
    exists = torch.cat((torch.ones_like(listed[..., :1]).expand(*listed.shape[:-1], 9), listed), -1)
    x = torch.cat((_node_class(cells, position, listed), counts), -1) * exists.unsqueeze(-1)
    waypoint, length = nearest_waypoint(frontiers, position)
    return Graph(
        x.float(),
        waypoint.masked_fill(~listed, 0),
        (length / lidar_range).masked_fill(~listed, 0.0),
        count.unsqueeze(-1),
    )


def _node_class(cells: Tensor, position: Tensor, listed: Tensor) -> Tensor:
    """One-hot {agent, traversable, non-traversable, frontier}: float32 ``[*B, 9 + M, 4]``."""
    free = feasible(cells, position)
    kind = torch.where(free, 1, 2)
    kind[..., 0] = 0
    kind = torch.cat((kind, torch.full_like(listed, 3, dtype=kind.dtype)), -1)
    return torch.nn.functional.one_hot(kind, 4).float()


def nearest_waypoint(frontiers: Tensor, position: Tensor) -> tuple[Tensor, Tensor]:
    """Finds the waypoint nearest to each frontier (Eq. 2), ties to the lower index.

    Args:
        frontiers: int64 ``[*B, M, 2]``.
        position: int64 ``[*B, 2]``.

    Returns:
        the waypoint's node, 1 to 8, int64 ``[*B, M]``, and the Euclidean distance to it in cells,
        float32 ``[*B, M]``.
    """
    waypoints = targets(position)[..., 1:, :]
    square = (frontiers.unsqueeze(-2) - waypoints.unsqueeze(-3)).square().sum(-1)  # (*B, M, 8)
    index = square.argmin(-1)
    return index + 1, square.gather(-1, index.unsqueeze(-1)).squeeze(-1).float().sqrt()


def edges(
    waypoint: Tensor, length: Tensor, frontiers: Tensor, *, lidar_range: float
) -> tuple[Tensor, Tensor]:
    """Writes out the edges of padded graphs, as graph libraries take them.

    Every graph has the same number of edges: the fixed ones, a self-loop of length 0 at each node,
    and both ways between each frontier and its waypoint. A padded node has self-loops instead, and
    so touches no other node.

    Args:
        waypoint: int64 ``[*B, M]``.
        length: float ``[*B, M]``, in units of ``l``.
        frontiers: int64 ``[*B, 1]``.
        lidar_range: ``l``, cells.

    Returns:
        source and target nodes, numbered within each graph, int64 ``[*B, 2, E]``; and the lengths
        in units of ``l``, ``[*B, E, 1]``; with ``E = 40 + (9 + M) + 2 M``.
    """
    batch, room = waypoint.shape[:-1], waypoint.shape[-1]
    device = waypoint.device
    node = torch.arange(WAYPOINTS, WAYPOINTS + room, device=device).expand(*batch, room)
    tied = torch.where(node - WAYPOINTS < frontiers, waypoint, node)
    fixed = WAYPOINT_EDGES.to(device)
    span = (
        (DISPLACEMENTS[WAYPOINT_EDGES[0]] - DISPLACEMENTS[WAYPOINT_EDGES[1]]).float().norm(dim=-1)
    )
    span = (span / lidar_range).to(device, length.dtype)
    loops = torch.arange(WAYPOINTS + room, device=device)
    same = torch.cat((fixed, loops.expand(2, -1)), -1).expand(*batch, 2, -1)
    out, back = torch.stack((node, tied), -2), torch.stack((tied, node), -2)
    padded = length.masked_fill(tied == node, 0.0)
    none = length.new_zeros(*batch, WAYPOINTS + room)
    attribute = torch.cat((span.expand(*batch, -1), none, padded, padded), -1)
    return torch.cat((same, out, back), -1), attribute.unsqueeze(-1)
