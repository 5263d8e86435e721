"""The exploration graph: Equations 1 and 2, and the node features."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from forestrl import functional as F
from tests import oracles
from tests.drawing import situation
from tests.graphs import edges_by_node, features_by_node
from tests.states import (
    BATCHES,
    assert_batched_equals_singles,
    at,
    cells_of,
    explored_state,
    explored_states,
    maps,
    random_state,
)

HAND = """
    ? ? ? ? ?
    ? . . . ?
    ? . A T ?
    ? . . . ?
    ? ? ? ? ?
"""


def graph(cells, position, *, window=3, max_frontiers=12, lidar_range=5.0):
    return F.exploration_graph(
        cells, position, window=window, max_frontiers=max_frontiers, lidar_range=lidar_range
    )


def ninths(one_hot: list[int], counts: list[int]) -> list[float]:
    return [*map(float, one_hot), *(count / 9 for count in counts)]


def assert_rows(x: torch.Tensor, expected: list[list[float]]) -> None:
    torch.testing.assert_close(x, torch.tensor(expected), rtol=0, atol=1e-6)


def test_graph_has_the_promised_shapes():
    cells, position = situation(HAND)
    x, waypoint, length, frontiers = graph(cells, position, max_frontiers=12)
    assert (x.shape, x.dtype) == ((9 + 12, 8), torch.float32)
    assert (waypoint.shape, waypoint.dtype) == ((12,), torch.int64)
    assert (length.shape, length.dtype) == ((12,), torch.float32)
    assert (frontiers.shape, frontiers.dtype) == ((1,), torch.int64)
    assert graph(cells, position)._fields == ("x", "waypoint", "length", "frontiers")


def test_node_features_of_the_agent_by_hand():
    cells, position = situation(HAND)
    # 8 free (7 of them frontier: all but the agent's own cell), 0 unknown, 1 trunk.
    assert_rows(graph(cells, position).x[:1], [ninths([1, 0, 0, 0], [8, 0, 1, 7])])


def test_node_features_of_waypoints_by_hand():
    cells, position = situation(HAND)
    x = graph(cells, position).x
    # a1 at (1, 1): free (1,1) (1,2) (2,1) (2,2), all frontier but (2,2); the other 5 unknown.
    assert_rows(x[1:2], [ninths([0, 1, 0, 0], [4, 5, 0, 3])])
    # a5 at (2, 3), the trunk: free (1,2) (1,3) (2,2) (3,2) (3,3), unknown column 4, itself.
    assert_rows(x[5:6], [ninths([0, 0, 1, 0], [5, 3, 1, 4])])


def test_node_features_of_frontiers_by_hand():
    cells, position = situation(HAND)
    x, waypoint, length, frontiers = graph(cells, position)
    assert frontiers.tolist() == [7]
    assert_rows(
        x[9 : 9 + 7],
        [  # nearest first, ties row-major
            ninths([0, 0, 0, 1], [5, 3, 1, 4]),  # (1, 2)
            ninths([0, 0, 0, 1], [6, 3, 0, 5]),  # (2, 1)
            ninths([0, 0, 0, 1], [5, 3, 1, 4]),  # (3, 2)
            ninths([0, 0, 0, 1], [4, 5, 0, 3]),  # (1, 1)
            ninths([0, 0, 0, 1], [3, 5, 1, 2]),  # (1, 3)
            ninths([0, 0, 0, 1], [4, 5, 0, 3]),  # (3, 1)
            ninths([0, 0, 0, 1], [3, 5, 1, 2]),  # (3, 3)
        ],
    )
    assert waypoint[:7].tolist() == [2, 4, 7, 1, 3, 6, 8]  # each lies on a waypoint's cell
    assert length[:7].tolist() == [0.0] * 7


def test_node_features_count_cells_outside_the_arena_as_occupied():
    cells, position = situation("""
        A . ?
        . . ?
        ? ? ?
    """)
    x = graph(cells, position).x
    # The agent in the corner: 4 free cells (3 frontier, not its own) and 5 outside.
    assert_rows(x[:1], [ninths([1, 0, 0, 0], [4, 0, 5, 3])])
    # a1 at (-1, -1) is outside: non-traversable, and only (0, 0) of its window is inside.
    assert_rows(x[1:2], [ninths([0, 0, 1, 0], [1, 0, 8, 0])])
    # a8 at (1, 1): 4 free, 5 unknown.
    assert_rows(x[8:9], [ninths([0, 1, 0, 0], [4, 5, 0, 3])])


def test_node_features_of_a_boxed_in_agent_have_no_traversable_waypoint():
    cells, position = situation("""
        T T T
        T A T
        T T T
    """)
    x, waypoint, length, frontiers = graph(cells, position)
    assert_rows(x[:, :4].sum(0, keepdim=True), [[1.0, 0.0, 8.0, 0.0]])
    assert frontiers.tolist() == [0] and not waypoint.any() and not length.any()


def test_padding_has_no_features_no_waypoint_and_no_length():
    cells, position = situation(HAND)
    x, waypoint, length, _ = graph(cells, position)
    assert not x[9 + 7 :].any()
    assert not waypoint[7:].any()
    assert not length[7:].any()


def test_a_graph_over_its_capacity_keeps_the_nearest_frontiers_and_counts_all():
    cells, position = situation(HAND)
    whole, cut = graph(cells, position), graph(cells, position, max_frontiers=3)
    assert cut.frontiers.tolist() == [7]
    assert torch.equal(cut.x, whole.x[: 9 + 3])
    assert cut.waypoint.tolist() == [2, 4, 7]


@given(maps(max_side=8), st.sampled_from([1, 3, 5, 7]))
def test_node_features_match_the_double_loop(state, window):
    cells, position = state
    found = graph(cells, position, window=window, max_frontiers=64)
    expected, _ = oracles.graph(cells.tolist(), at(position), side=window, lidar_range=5.0)
    features = features_by_node(found, cells, position)
    assert features.keys() == expected.keys()
    for node, row in features.items():
        assert row == pytest.approx(expected[node], abs=1e-6)


@given(maps(max_side=8))
def test_node_features_are_one_class_and_shares_of_the_window(state):
    found = graph(*state, window=5, max_frontiers=64)
    x = found.x[: 9 + found.frontiers.item()]
    assert torch.equal(x[:, :4].sum(-1), torch.ones(len(x)))
    assert ((x[:, :4] == 0) | (x[:, :4] == 1)).all()
    torch.testing.assert_close(x[:, 4:7].sum(-1), torch.ones(len(x)))  # every cell is one of three
    assert (x[:, 7] <= x[:, 4] + 1e-6).all()  # a frontier cell is free


def test_equation_2_ties_a_frontier_to_its_nearest_waypoint():
    cells, position = situation("""
        . . . . . . ?
        . . . . . . .
        . . A . . . .
        . . . . . . .
        ? . . . . . .
    """)
    found = graph(cells, position, lidar_range=4.0)
    order = [[4, 1], [3, 0], [3, 1], [0, 5], [1, 5], [1, 6]]
    index, count = F.nearest_first(F.frontier(cells), position, 6)
    assert count == 6
    assert sorted(index.tolist()) == sorted(order)
    nearest = dict(zip(map(tuple, index.tolist()), found.waypoint.tolist(), strict=False))
    lengths = dict(zip(map(tuple, index.tolist()), found.length.tolist(), strict=False))
    # Below left: (3, 1) is the cell of a6, (3, 0) is 1 and (4, 1) is 1 from it.
    assert [nearest[c] for c in [(3, 1), (3, 0), (4, 1)]] == [6, 6, 6]
    assert [lengths[c] for c in [(3, 1), (3, 0), (4, 1)]] == [0.0, 0.25, 0.25]
    # Above right: a3 is at (1, 3).
    assert [nearest[c] for c in [(0, 5), (1, 5), (1, 6)]] == [3, 3, 3]
    expected = [math.sqrt(5) / 4, 2 / 4, 3 / 4]
    assert [lengths[c] for c in [(0, 5), (1, 5), (1, 6)]] == pytest.approx(expected)


def test_equation_2_gives_a_tie_to_the_lower_index():
    """A frontier under the agent is 1 from a2, a4, a5 and a7: the only tie there can be."""
    cells, position = situation("""
        T T ?
        T A T
        T T T
    """)
    found = graph(cells, position)
    assert found.frontiers.item() == 1
    assert found.waypoint[0] == 2
    assert found.length[0].item() == pytest.approx(1 / 5)


@given(maps(max_side=8))
def test_equation_2_points_where_the_frontier_lies(state):
    """The nearest of the eight is the one at the signs of the offset; under the agent, a2."""
    cells, position = state
    found = graph(cells, position, max_frontiers=64)
    index, count = F.nearest_first(F.frontier(cells), position, 64)
    for frontier, waypoint in zip(index[:count], found.waypoint, strict=False):
        sign = (frontier - position).sign()
        expected = sign if sign.any() else torch.tensor([-1, 0])
        assert torch.equal(F.DISPLACEMENTS[waypoint], expected)


@pytest.mark.parametrize("batch", BATCHES)
def test_graphs_of_a_stack_are_the_stack_of_graphs(batch):
    for cells, position in (explored_states(8, batch)[1:], random_state(8, batch)):
        assert_batched_equals_singles(graph, cells, position, batch=batch)


@given(st.integers(0, 1000))
def test_a_graph_matches_the_double_loop_on_an_explored_arena(seed):
    _, cells, position = explored_state(seed)
    found = graph(cells, position, window=7, max_frontiers=64, lidar_range=4.0)
    x, edges = oracles.graph(cells.tolist(), at(position), side=7, lidar_range=4.0)
    features = features_by_node(found, cells, position)
    assert features.keys() == x.keys()
    for node, row in features.items():
        assert row == pytest.approx(x[node], abs=1e-6)
    lengths = edges_by_node(found, cells, position, lidar_range=4.0)
    assert lengths == pytest.approx(edges, abs=1e-6)
    assert len(cells_of(F.frontier(cells))) == found.frontiers.item()
