"""Table I, feasibility, Algorithm 1 and the move."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from forestrl import functional as F
from tests import oracles
from tests.drawing import situation, world
from tests.states import (
    BATCHES,
    assert_batched_equals_singles,
    at,
    explored_states,
    maps,
    random_state,
    worlds,
)

feasible_actions = st.lists(st.booleans(), min_size=8, max_size=8).map(lambda free: [True, *free])


def test_table_1_displacements():
    assert F.DISPLACEMENTS.tolist() == [
        [0, 0],
        [-1, -1],
        [-1, 0],
        [-1, 1],
        [0, -1],
        [0, 1],
        [1, -1],
        [1, 0],
        [1, 1],
    ]
    assert F.DISPLACEMENTS.dtype == torch.int64
    assert F.NULL_ACTION == 0


def test_feasible_targets_are_known_free_cells():
    cells, position = situation("""
        . T ?
        . A .
        T T .
    """)
    #         a0    (-1,-1) (-1,0) (-1,1) (0,-1) (0,1) (1,-1) (1,0) (1,1)
    expected = [True, True, False, False, True, True, False, False, True]
    assert F.feasible(cells, position).tolist() == expected
    assert F.feasible(cells, position).dtype == torch.bool


def test_feasible_targets_are_inside_the_arena():
    cells, position = situation("""
        A .
        . .
    """)
    expected = [True, False, False, False, False, True, False, True, True]
    assert F.feasible(cells, position).tolist() == expected


@pytest.mark.parametrize("own_cell", list(F.Cell))
def test_the_null_action_is_feasible_whatever_the_map_says_of_the_agents_cell(own_cell):
    cells = torch.full((3, 3), int(F.Cell.OCCUPIED), dtype=torch.uint8)
    cells[1, 1] = int(own_cell)
    assert F.feasible(cells, torch.tensor([1, 1])).tolist() == [True] + [False] * 8


def test_a_diagonal_between_two_trunks_is_feasible():
    cells, position = situation("""
        . T
        T A
    """)
    assert F.feasible(cells, position)[1]


@given(maps())
def test_feasibility_matches_the_loop(state):
    cells, position = state
    assert F.feasible(cells, position).tolist() == oracles.feasible(cells.tolist(), at(position))


@pytest.mark.parametrize("action", range(9))
def test_algorithm_1_keeps_a_feasible_action(action):
    assert F.safe_action(torch.tensor(action), torch.ones(9, dtype=torch.bool)) == action


def test_algorithm_1_replaces_an_infeasible_action_by_the_nearest_index():
    feasible = torch.tensor([True, True, False, False, False, False, True, False, False])
    assert F.safe_action(torch.tensor(4), feasible) == 6  # |4-6| = 2 < |4-1| = 3


def test_algorithm_1_gives_a_tie_to_the_lower_index():
    cells, position = situation("""
        . . .
        . A T
        . . .
    """)
    feasible = F.feasible(cells, position)
    assert F.safe_action(torch.tensor(5), feasible) == 4  # |4-5| = |6-5|


def test_algorithm_1_does_not_substitute_the_null_action_while_another_is_feasible():
    feasible = torch.tensor([True, False, False, False, False, False, False, False, True])
    assert F.safe_action(torch.tensor(1), feasible) == 8  # although |1-0| = 1 < |1-8| = 7


def test_algorithm_1_falls_back_to_the_null_action_when_boxed_in():
    cells, position = situation("""
        T T T
        T A T
        T T T
    """)
    feasible = F.feasible(cells, position)
    assert [int(F.safe_action(torch.tensor(a), feasible)) for a in range(9)] == [0] * 9


def test_algorithm_1_keeps_a_chosen_null_action():
    assert F.safe_action(torch.tensor(0), torch.ones(9, dtype=torch.bool)) == F.NULL_ACTION


@given(feasible_actions, st.integers(0, 8))
def test_algorithm_1_matches_its_pseudocode(feasible, action):
    executed = F.safe_action(torch.tensor(action), torch.tensor(feasible))
    assert executed.shape == () and executed.dtype == torch.int64
    assert executed == oracles.safe_action(action, feasible)


@given(feasible_actions, st.integers(0, 8))
def test_algorithm_1_never_returns_an_infeasible_action(feasible, action):
    executed = F.safe_action(torch.tensor(action), torch.tensor(feasible))
    assert feasible[executed]
    if executed == F.NULL_ACTION and action != F.NULL_ACTION:
        assert not any(feasible[1:])


@pytest.mark.parametrize("action", range(9))
def test_a_move_adds_the_displacement_of_table_1(action):
    trees, position = world("""
        . . .
        . A .
        . . .
    """)
    moved, collision = F.move(trees, position, torch.tensor(action))
    assert moved.tolist() == [1 + F.DISPLACEMENTS[action, 0], 1 + F.DISPLACEMENTS[action, 1]]
    assert moved.dtype == torch.int64
    assert collision.shape == () and not collision


def test_a_move_into_a_trunk_stays_and_collides():
    trees, position = world("A T")
    moved, collision = F.move(trees, position, torch.tensor(5))
    assert moved.tolist() == [0, 0]
    assert collision


@pytest.mark.parametrize("action", [1, 2, 3, 4, 6])
def test_a_move_out_of_the_arena_stays_and_collides(action):
    trees, position = world("""
        A .
        . .
    """)
    moved, collision = F.move(trees, position, torch.tensor(action))
    assert moved.tolist() == [0, 0]
    assert collision


def test_a_move_between_two_trunks_passes():
    trees, position = world("""
        . T
        T A
    """)
    moved, collision = F.move(trees, position, torch.tensor(1))
    assert moved.tolist() == [0, 0]
    assert not collision


@given(worlds(), st.integers(0, 8))
def test_a_move_never_ends_on_a_trunk_or_outside(state, action):
    trees, position = state
    moved, collision = F.move(trees, position, torch.tensor(action))
    target = oracles.add(at(position), oracles.TABLE_1[action])
    possible = oracles.inside(trees.tolist(), target) and not trees[target]
    assert collision == (not possible)
    assert at(moved) == (target if possible else at(position))


@pytest.mark.parametrize("batch", BATCHES)
def test_actions_of_a_stack_are_the_stack_of_actions(batch):
    cells, position = random_state(5, batch)
    assert_batched_equals_singles(F.feasible, cells, position, batch=batch)
    rng = torch.Generator().manual_seed(6)
    action = torch.randint(9, batch, generator=rng)
    feasible = F.feasible(cells, position)
    assert_batched_equals_singles(F.safe_action, action, feasible, batch=batch)
    trees, _, position = explored_states(7, batch)
    assert_batched_equals_singles(F.move, trees, position, action, batch=batch)
