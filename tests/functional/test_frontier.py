"""The frontier and its nearest cells."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from forestrl import functional as F
from tests import oracles
from tests.drawing import parse_cells, situation
from tests.states import (
    BATCHES,
    assert_batched_equals_singles,
    at,
    cells_of,
    explored_state,
    explored_states,
    maps,
    mask_of,
    turned,
)


def test_frontier_is_the_known_free_cells_beside_unknown_ones():
    cells, _ = situation("""
        A . . ?
        . . . ?
        . . T ?
        . . . .
    """)
    # The trunk (2, 2) borders on the unknown but is not free; (3, 2) touches (2, 3) diagonally.
    assert cells_of(F.frontier(cells)) == {(0, 2), (1, 2), (3, 2), (3, 3)}


def test_frontier_ignores_what_lies_outside_the_arena():
    cells, _ = situation("""
        A .
        . T
    """)
    assert not F.frontier(cells).any()


def test_frontier_of_an_unknown_map_is_empty():
    assert not F.frontier(parse_cells("? ? ?")).any()


def test_frontier_counts_a_diagonal_neighbour():
    cells, _ = situation("""
        A T
        T ?
    """)
    assert cells_of(F.frontier(cells)) == {(0, 0)}


@given(maps(max_side=9))
def test_frontier_matches_the_double_loop(state):
    cells, _ = state
    mask = F.frontier(cells)
    assert mask.dtype == torch.bool
    assert cells_of(mask) == oracles.frontier(cells.tolist())


@given(maps(max_side=9))
def test_frontier_turns_with_the_arena(state):
    cells, _ = state
    assert torch.equal(F.frontier(turned(cells)), turned(F.frontier(cells)))


@given(st.integers(0, 1000))
def test_frontier_turns_with_an_explored_arena(seed):
    _, cells, _ = explored_state(seed, size=9)
    assert torch.equal(F.frontier(turned(cells)), turned(F.frontier(cells)))


@pytest.mark.parametrize("batch", BATCHES)
def test_frontiers_of_a_stack_are_the_stack_of_frontiers(batch):
    _, cells, _ = explored_states(4, batch)
    assert_batched_equals_singles(F.frontier, cells, batch=batch)


def test_nearest_first_orders_by_distance_and_ties_by_row_and_column():
    mask = mask_of({(0, 0), (0, 2), (1, 3), (2, 0), (2, 1), (4, 4)}, torch.zeros(5, 5))
    index, count = F.nearest_first(mask, torch.tensor([1, 1]), 8)
    assert index.tolist() == [
        [2, 1],  # 1
        [0, 0],  # sqrt(2), and so are the next two: row-major
        [0, 2],
        [2, 0],
        [1, 3],  # 2
        [4, 4],  # sqrt(18)
        [0, 0],  # padding
        [0, 0],
    ]
    assert count.shape == () and count == 6
    assert index.dtype == count.dtype == torch.int64


def test_nearest_first_keeps_the_nearest_when_the_capacity_overflows():
    mask = mask_of({(0, 0), (0, 2), (1, 3), (2, 0), (2, 1), (4, 4)}, torch.zeros(5, 5))
    index, count = F.nearest_first(mask, torch.tensor([1, 1]), 2)
    assert index.tolist() == [[2, 1], [0, 0]]
    assert count == 6  # all of them, not only those kept


def test_nearest_first_may_start_on_the_frontier():
    mask = mask_of({(1, 1)}, torch.zeros(3, 3))
    index, count = F.nearest_first(mask, torch.tensor([1, 1]), 1)
    assert index.tolist() == [[1, 1]] and count == 1


def test_nearest_first_of_nothing_is_padding():
    index, count = F.nearest_first(torch.zeros(3, 4, dtype=torch.bool), torch.tensor([1, 1]), 3)
    assert index.tolist() == [[0, 0]] * 3
    assert count == 0


def test_nearest_first_takes_a_capacity_larger_than_the_arena():
    index, count = F.nearest_first(torch.ones(2, 2, dtype=torch.bool), torch.tensor([1, 0]), 256)
    assert index.shape == (256, 2)
    assert index[:4].tolist() == [[1, 0], [0, 0], [1, 1], [0, 1]]  # 0, 1, 1, sqrt(2)
    assert not index[4:].any() and count == 4


@given(maps(max_side=9), st.integers(1, 40))
def test_nearest_first_matches_the_sort(state, capacity):
    cells, position = state
    mask = F.frontier(cells)
    index, count = F.nearest_first(mask, position, capacity)
    expected = oracles.nearest_first(cells_of(mask), at(position))[:capacity]
    assert count == len(cells_of(mask))
    assert [tuple(cell) for cell in index[: len(expected)].tolist()] == expected
    assert not index[len(expected) :].any()


def test_nearest_first_keeps_ties_apart_in_the_largest_arena():
    """Distances of 50 to 140 cells still have exact ties and exact differences."""
    mask = torch.rand(100, 100, generator=torch.Generator().manual_seed(0)) < 0.05
    index, _ = F.nearest_first(mask, torch.tensor([0, 99]), 1000)
    expected = oracles.nearest_first(cells_of(mask), (0, 99))
    assert [tuple(cell) for cell in index[: len(expected)].tolist()] == expected


@pytest.mark.parametrize("capacity", [3, 60])
@pytest.mark.parametrize("batch", BATCHES)
def test_nearest_first_of_a_stack_is_the_stack_of_nearest_first(batch, capacity):
    _, cells, position = explored_states(5, batch)
    mask = F.frontier(cells)
    assert_batched_equals_singles(
        lambda m, p: F.nearest_first(m, p, capacity), mask, position, batch=batch
    )
