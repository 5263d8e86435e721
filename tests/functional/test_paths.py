"""Path lengths over known free cells."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given

from forestrl import functional as F
from tests import oracles
from tests.drawing import situation
from tests.states import (
    BATCHES,
    assert_batched_equals_singles,
    at,
    explored_states,
    maps,
    turned,
    turned_position,
)

inf = math.inf


def test_path_lengths_count_moves_around_a_wall():
    cells, position = situation("""
        A T . .
        . T . ?
        . . . .
    """)
    lengths = F.path_lengths(cells == F.Cell.FREE, position)
    assert lengths.dtype == torch.float32
    assert lengths.tolist() == [
        [0, inf, 4, 4],  # (0,0) - (1,0) - (2,1) - (1,2) - (0,2) or (0,3)
        [1, inf, 3, inf],
        [2, 2, 3, 4],
    ]


def test_path_lengths_count_a_diagonal_as_one_move():
    free = torch.ones(4, 4, dtype=torch.bool)
    lengths = F.path_lengths(free, torch.tensor([0, 0]))
    assert lengths.tolist() == [[0, 1, 2, 3], [1, 1, 2, 3], [2, 2, 2, 3], [3, 3, 3, 3]]


def test_path_lengths_pass_between_two_trunks_that_touch_at_a_corner():
    cells, position = situation("""
        A T
        T .
    """)
    assert F.path_lengths(cells == F.Cell.FREE, position).tolist() == [[0, inf], [inf, 1]]


def test_path_lengths_are_infinite_in_a_sealed_pocket():
    cells, position = situation("A T .")
    assert F.path_lengths(cells == F.Cell.FREE, position).tolist() == [[0, inf, inf]]


def test_path_lengths_follow_the_longest_corridor():
    cells, position = situation("""
        A . . . .
        T T T T .
        . . . . .
        . T T T T
        . . . . .
    """)
    lengths = F.path_lengths(cells == F.Cell.FREE, position)
    # 3 to (0, 3), 4 to (1, 4), 5 to (2, 3), 7 to (2, 1), 8 to (3, 0), 9 to (4, 1), 12 to (4, 4)
    assert [lengths[cell].item() for cell in [(0, 3), (1, 4), (2, 3), (2, 1)]] == [3, 4, 5, 7]
    assert [lengths[cell].item() for cell in [(3, 0), (4, 1), (4, 4)]] == [8, 9, 12]


@given(maps(max_side=9))
def test_path_lengths_match_the_breadth_first_search(state):
    cells, position = state
    free = cells == F.Cell.FREE
    lengths = F.path_lengths(free, position)
    expected = oracles.path_lengths(free.tolist(), at(position))
    for cell in oracles.all_cells(free.tolist()):
        assert lengths[cell] == expected.get(cell, inf)


@given(maps(max_side=9))
def test_path_lengths_are_finite_exactly_within_the_component(state):
    cells, position = state
    free = cells == F.Cell.FREE
    lengths = F.path_lengths(free, position)
    assert torch.equal(lengths.isfinite(), F.component(free, position))


@given(maps(max_side=9))
def test_path_lengths_turn_with_the_arena(state):
    cells, position = state
    free = cells == F.Cell.FREE
    there = turned_position(position, free.shape[-1])
    assert torch.equal(F.path_lengths(turned(free), there), turned(F.path_lengths(free, position)))


@pytest.mark.parametrize("batch", BATCHES)
def test_path_lengths_of_a_stack_are_the_stack_of_path_lengths(batch):
    _, cells, position = explored_states(6, batch, density=0.4)
    assert_batched_equals_singles(F.path_lengths, cells == F.Cell.FREE, position, batch=batch)
