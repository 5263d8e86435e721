"""Equations 6 to 9: the reward and the frontier potential."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from forestrl import functional as F
from tests import oracles
from tests.drawing import parse_cells, situation, world
from tests.states import (
    BATCHES,
    assert_batched_equals_singles,
    at,
    explored_state,
    explored_states,
    maps,
    random_state,
    turned,
    turned_position,
)


def potential(cells, position, *, window=3, beta=0.5):
    return F.potential(cells, position, window=window, beta=beta)


def reward(new_cells, before, after, *, explored, unsafe):
    return F.reward(
        torch.tensor([new_cells]),
        torch.tensor([before]),
        torch.tensor([after]),
        explored=torch.tensor([explored]),
        unsafe=torch.tensor([unsafe]),
        r_explored=100.0,
        r_unsafe=-5.0,
    )


@pytest.mark.parametrize(
    ("explored", "unsafe", "expected"),
    [
        (False, False, 7 + 0.75 - 0.5),  # n^e + Phi(s') - Phi(s)
        (True, False, 100.0),
        (False, True, -5.0),
        (True, True, -5.0),  # an intervened step that completes the map is still unsafe
    ],
)
def test_equation_6_truth_table(explored, unsafe, expected):
    value = reward(7.0, 0.5, 0.75, explored=explored, unsafe=unsafe)
    assert value.shape == (1,) and value.dtype == torch.float32
    assert value.item() == expected


def test_equation_6_is_a_plain_difference():
    """Without a discount: a potential that stays adds nothing, and one that falls takes away."""
    assert reward(0.0, 0.625, 0.625, explored=False, unsafe=False).item() == 0.0
    assert reward(2.0, 0.75, 0.5, explored=False, unsafe=False).item() == 1.75


@pytest.mark.parametrize("batch", BATCHES)
def test_equation_6_of_a_stack_is_the_stack_of_rewards(batch):
    rng = torch.Generator().manual_seed(0)
    new_cells, before, after = torch.rand(3, *batch, 1, generator=rng)
    explored, unsafe = torch.rand(2, *batch, 1, generator=rng) < 0.5

    def function(n, phi, next_phi, e, u):
        return F.reward(n, phi, next_phi, explored=e, unsafe=u, r_explored=100.0, r_unsafe=-5.0)

    inputs = (new_cells, before, after, explored, unsafe)
    assert_batched_equals_singles(function, *inputs, batch=batch)


def test_equations_7_to_9_by_hand():
    cells, position = situation("""
        A . . ? ?
        . . . ? ?
        . . . ? ?
        ? ? ? ? ?
        ? ? ? ? ?
    """)
    # The scale of distances is sqrt(2) * 4. The frontiers, with the unknown cells around them:
    # (0, 2): d = 2,       2 of 9;  (-2 / 5.657 + 0.5 * 2/9 + 1) / 1.5 = 0.5050
    # (1, 2): d = sqrt(5), 3 of 9;  (-0.3953 + 0.1667 + 1) / 1.5      = 0.5143
    # (2, 2): d = sqrt(8), 5 of 9;  (-1/2 + 0.5 * 5/9 + 1) / 1.5      = 14/27 = 0.5185, the best
    value = potential(cells, position)
    assert value.shape == (1,) and value.dtype == torch.float32
    assert value.item() == pytest.approx(14 / 27, abs=1e-6)


def test_equation_9_weighs_distance_against_gain():
    cells, position = situation("""
        A . . ? ?
        . . . ? ?
        . . . ? ?
        ? ? ? ? ?
        ? ? ? ? ?
    """)
    # beta = 0: the nearest frontier, at 2: 1 - 2 / (4 sqrt(2))
    nearest = 1 - 2 / (4 * math.sqrt(2))
    assert potential(cells, position, beta=0.0).item() == pytest.approx(nearest, abs=1e-6)
    # beta = 1: (2, 2) again: (-1/2 + 5/9 + 1) / 2
    assert potential(cells, position, beta=1.0).item() == pytest.approx(19 / 36, abs=1e-6)


def test_equation_8_counts_no_unknown_cells_outside_the_arena():
    cells, position = situation("""
        A ?
        ? ?
    """)
    # The agent stands on the only frontier: d = 0, and 3 of the 9 cells are unknown.
    assert potential(cells, position).item() == pytest.approx((0.5 * 3 / 9 + 1) / 1.5, abs=1e-6)


def test_potential_without_frontiers_is_zero():
    cells, position = situation("""
        T T T
        T A T
        T T T
    """)
    assert potential(cells, position).tolist() == [0.0]
    assert potential(parse_cells("? ?\n? ?"), torch.tensor([0, 0])).tolist() == [0.0]


def test_potential_rises_as_the_distance_falls():
    cells = parse_cells("""
        . . . . . ?
        T T T T T T
        T T T T T T
        T T T T T T
        T T T T T T
        T T T T T T
    """)
    walk = [potential(cells, torch.tensor([0, col])).item() for col in range(5)]
    assert all(after > before for before, after in pairwise(walk))
    # Each step changes it by 1 / (sqrt(2) * 5) / 1.5.
    assert walk[1] - walk[0] == pytest.approx(1 / (math.sqrt(2) * 5 * 1.5), abs=1e-6)


def test_potential_rises_with_the_information_gain():
    drawings = [
        "T T T T\nA . . T\nT T T ?",
        "T T T ?\nA . . T\nT T T ?",
        "T T T ?\nA . . ?\nT T T ?",
    ]
    drawings = [drawing + "\nT T T T" for drawing in drawings]  # 1, 2, 3 unknown around (1, 2)
    values = [potential(*situation(drawing)).item() for drawing in drawings]
    distance = 2 / (math.sqrt(2) * 3)
    expected = [(-distance + 0.5 * gain / 9 + 1) / 1.5 for gain in (1, 2, 3)]
    assert values == pytest.approx(expected, abs=1e-6)


@given(maps(max_side=9, square=True), st.sampled_from([1, 3, 7]), st.sampled_from([0.25, 0.5, 1.0]))
def test_potential_matches_the_loop_and_lies_between_zero_and_one(state, window, beta):
    cells, position = state
    value = potential(cells, position, window=window, beta=beta).item()
    expected = oracles.potential(cells.tolist(), at(position), side=window, beta=beta)
    assert value == pytest.approx(expected, abs=1e-6)
    assert 0 <= value <= 1


@given(st.integers(0, 1000))
def test_potential_turns_with_the_arena(seed):
    _, cells, position = explored_state(seed, size=10)
    there = turned_position(position, cells.shape[-1])
    expected = potential(cells, position, window=5).item()
    assert potential(turned(cells), there, window=5).item() == pytest.approx(expected, abs=1e-6)


def test_potential_is_not_constant_over_a_walk():
    trees, position = world("""
        A . . . . . . .
        . . . T . . . .
        . . . . . . T .
        . T . . . . . .
        . . . . T . . .
        . . . . . . . .
        . . T . . . . .
        . . . . . . . .
    """)
    lines = F.sight_lines(2.5)
    cells = torch.zeros_like(trees, dtype=torch.uint8)
    truth = torch.where(trees, int(F.Cell.OCCUPIED), int(F.Cell.FREE)).to(torch.uint8)
    values = []
    for action in (8, 5, 8, 7, 7, 8, 5):
        position, collision = F.move(trees, position, torch.tensor(action))
        assert not collision
        cells = torch.where(F.scan(trees, position, lines), truth, cells)
        values.append(potential(cells, position).item())
    assert len({round(value, 4) for value in values}) > 3


@pytest.mark.parametrize("batch", BATCHES)
def test_potentials_of_a_stack_are_the_stack_of_potentials(batch):
    for cells, position in (explored_states(11, batch)[1:], random_state(11, batch)):
        assert_batched_equals_singles(potential, cells, position, batch=batch)
