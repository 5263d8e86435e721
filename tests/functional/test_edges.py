"""The edges of the exploration graph, from Equations 1 and 2."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given

from forestrl import functional as F
from tests import oracles
from tests.drawing import situation
from tests.graphs import edges_by_node
from tests.states import BATCHES, assert_batched_equals_singles, at, explored_states, maps

CAPACITY = 10


def graph(cells, position, max_frontiers=CAPACITY):
    return F.exploration_graph(
        cells, position, window=3, max_frontiers=max_frontiers, lidar_range=5.0
    )


def edges(cells, position, max_frontiers=CAPACITY):
    found = graph(cells, position, max_frontiers)
    return F.edges(found.waypoint, found.length, found.frontiers, lidar_range=5.0)


def test_equation_1_joins_waypoints_at_chebyshev_distance_one():
    """Table I's order: 1 2 3 above, 4 and 5 beside, 6 7 8 below the agent."""
    rows = {(1, 2), (2, 3), (6, 7), (7, 8)}
    columns = {(1, 4), (4, 6), (3, 5), (5, 8)}
    corners_cut = {(2, 4), (2, 5), (4, 7), (5, 7)}
    undirected = rows | columns | corners_cut
    spokes = {(0, i) for i in range(1, 9)}
    pairs = [tuple(pair) for pair in F.WAYPOINT_EDGES.T.tolist()]
    both_ways = undirected | spokes | {(j, i) for i, j in undirected | spokes}
    assert set(pairs) == both_ways
    assert len(pairs) == len(both_ways) == 2 * (12 + 8)
    assert F.WAYPOINT_EDGES.dtype == torch.int64


def test_equation_1_is_an_equivalence_over_all_pairs_of_waypoints():
    pairs = {tuple(pair) for pair in F.WAYPOINT_EDGES.T.tolist()}
    for i in range(1, 9):
        for j in range(1, 9):
            chebyshev = (F.DISPLACEMENTS[i] - F.DISPLACEMENTS[j]).abs().max()
            assert ((i, j) in pairs) == (i != j and chebyshev <= 1)


def test_edges_of_a_drawn_arena():
    """The corridor's one frontier is (0, 3), 2 from a5 at (0, 1)... in units of l = 5."""
    cells, position = situation("A . . . ?")
    index, length = edges(cells, position, max_frontiers=2)
    found = {
        (s, t): value
        for (s, t), value in zip(index.T.tolist(), length.squeeze(-1).tolist(), strict=True)
    }
    straight, diagonal = 1 / 5, math.sqrt(2) / 5
    for i in range(1, 9):
        spoke = diagonal if i in (1, 3, 6, 8) else straight
        assert found[0, i] == found[i, 0] == pytest.approx(spoke)
    assert found[1, 2] == pytest.approx(straight)
    assert found[2, 4] == pytest.approx(diagonal)
    assert found[9, 5] == found[5, 9] == pytest.approx(2 / 5)
    assert all(found[i, i] == 0 for i in range(9 + 2))
    assert set(found) - {(i, i) for i in range(11)} - {(9, 5), (5, 9)} == {
        tuple(pair) for pair in F.WAYPOINT_EDGES.T.tolist()
    }


@pytest.mark.parametrize("batch", BATCHES)
def test_edges_have_a_static_shape(batch):
    _, cells, position = explored_states(9, batch)
    index, length = edges(cells, position)
    count = 40 + (9 + CAPACITY) + 2 * CAPACITY
    assert (index.shape, index.dtype) == ((*batch, 2, count), torch.int64)
    assert (length.shape, length.dtype) == ((*batch, count, 1), torch.float32)


def test_a_padded_frontier_is_joined_to_nothing_but_itself():
    cells, position = situation("A . . . ?")
    index, length = edges(cells, position, max_frontiers=4)
    padded = (index >= 9 + 1).any(0)
    assert padded.sum() == 3 * 3  # its self-loop, and its two frontier edges folded onto itself
    assert torch.equal(index[0, padded], index[1, padded])
    assert not length[padded].any()


@pytest.mark.parametrize("capacity", [1, 2])
def test_an_overflowing_graph_keeps_an_edge_pair_for_each_frontier_it_keeps(capacity):
    cells, position = situation("""
        . . . ?
        . A . ?
        . . . ?
    """)
    assert graph(cells, position, capacity).frontiers.item() == 3 > capacity
    index, _ = edges(cells, position, capacity)
    between = index[:, ((index >= 9).sum(0) == 1)]
    assert between.shape[-1] == 2 * capacity


@given(maps(max_side=8))
def test_edges_match_the_double_loop(state):
    cells, position = state
    found = edges_by_node(graph(cells, position, 64), cells, position, lidar_range=5.0)
    _, expected = oracles.graph(cells.tolist(), at(position), side=3, lidar_range=5.0)
    assert found == pytest.approx(expected, abs=1e-6)


@given(maps(max_side=8))
def test_edges_go_both_ways_and_every_node_has_its_loop(state):
    cells, position = state
    index, length = edges(cells, position, 64)
    found = dict(zip(map(tuple, index.T.tolist()), length.squeeze(-1).tolist(), strict=True))
    assert all(found[t, s] == value for (s, t), value in found.items())
    assert all(found[i, i] == 0 for i in range(9 + 64))


@given(maps(max_side=8))
def test_equation_2_gives_each_frontier_one_edge_pair(state):
    cells, position = state
    found = graph(cells, position, 64)
    index, _ = edges(cells, position, 64)
    count = found.frontiers.item()
    outgoing = index[:, (index[0] >= 9) & (index[0] != index[1])]
    assert outgoing[0].sort().values.tolist() == list(range(9, 9 + count))
    assert ((1 <= outgoing[1]) & (outgoing[1] <= 8)).all()


@pytest.mark.parametrize("batch", BATCHES)
def test_edges_of_a_stack_are_the_stack_of_edges(batch):
    _, cells, position = explored_states(10, batch)
    assert_batched_equals_singles(edges, cells, position, batch=batch)
