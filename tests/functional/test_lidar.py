"""Sight lines and scans."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from forestrl import functional as F
from tests import oracles
from tests.drawing import draw, parse_cells, rows_of, world
from tests.states import (
    BATCHES,
    assert_batched_equals_singles,
    at,
    cells_of,
    explored_states,
    turned,
    turned_position,
    worlds,
)

RANGES = [1.0, 1.5, 2.5, 5.0, 8.0]


def seen_in(drawing: str, lidar_range: float) -> str:
    """The drawing of what is seen of a world: ``?`` for what is not."""
    trees, position = world(drawing)
    seen = F.scan(trees, position, F.sight_lines(lidar_range))
    lines = rows_of(drawing)
    return "\n".join(
        " ".join(letter if seen[row, col] else "?" for col, letter in enumerate(line))
        for row, line in enumerate(lines)
    )


def lines_of(lidar_range: float) -> dict[tuple[int, int], set[tuple[int, int]]]:
    """Each offset of the library's sight lines with the offsets between, padding left out."""
    lines = F.sight_lines(lidar_range)
    return {
        tuple(offset): {tuple(step) for step in between} - {(0, 0)}
        for offset, between in zip(lines.offsets.tolist(), lines.between.tolist(), strict=True)
    }


@pytest.mark.parametrize(
    ("offset", "between"),
    [
        ((0, 3), {(0, 1), (0, 2)}),
        ((3, 3), {(1, 1), (2, 2)}),
        ((1, 2), {(1, 1)}),  # i = 1: (1/2, 1), the half goes away from zero
        ((-1, 2), {(-1, 1)}),
        ((1, -2), {(1, -1)}),
        ((-2, -1), {(-1, -1)}),
        ((3, 1), {(1, 0), (2, 1)}),  # 1/3 and 2/3
        ((-1, -4), {(0, -1), (-1, -2), (-1, -3)}),  # 1/4, 2/4, 3/4
        ((4, 2), {(1, 1), (2, 1), (3, 2)}),  # 1/2, 1, 3/2
        ((1, 1), set()),
        ((0, -1), set()),
    ],
)
def test_sight_line_rounds_halves_away_from_zero(offset, between):
    assert lines_of(5.0)[offset] == between
    assert set(oracles.sight_line(offset)) == between


@pytest.mark.parametrize(("lidar_range", "cells"), [(1.0, 5), (2.5, 21), (5.0, 81), (8.0, 197)])
def test_sight_lines_reach_every_offset_within_the_range_once(lidar_range, cells):
    lines = F.sight_lines(lidar_range)
    offsets = [tuple(offset) for offset in lines.offsets.tolist()]
    reach = range(-9, 10)
    disc = {(row, col) for row in reach for col in reach if math.hypot(row, col) <= lidar_range}
    assert len(disc) == cells
    assert len(offsets) == len(set(offsets))
    assert set(offsets) | {(0, 0)} == disc


@pytest.mark.parametrize("lidar_range", RANGES)
def test_sight_lines_match_the_loop(lidar_range):
    for offset, between in lines_of(lidar_range).items():
        assert between == set(oracles.sight_line(offset))
    lines = F.sight_lines(lidar_range)
    assert lines.offsets.dtype == lines.between.dtype == torch.int64
    assert lines.between.shape[0] == lines.offsets.shape[0]


def test_scan_sees_a_disc_in_the_open():
    trees = torch.zeros(50, 50, dtype=torch.bool)
    seen = cells_of(F.scan(trees, torch.tensor([20, 30]), F.sight_lines(5.0)))
    assert len(seen) == 81
    assert (20 + 3, 30 + 4) in seen  # the length is 5
    assert (20 + 5, 30 + 1) not in seen  # the length is sqrt(26) > 5


def test_scan_sees_a_trunk_but_nothing_behind_it():
    assert seen_in("A . T . .", 4.0) == "A . T ? ?"


def test_scan_passes_between_two_trunks_that_touch_at_a_corner():
    drawing = """
        A T .
        T . .
        . . .
    """
    # The lines to (1, 2), (2, 1) and (2, 2) pass (1, 1), which is free.
    assert seen_in(drawing, 5.0) == "A T ?\nT . .\n? . ."


def test_scan_is_cut_by_the_arena():
    trees, position = world("""
        A . .
        . . .
    """)
    assert F.scan(trees, position, F.sight_lines(5.0)).all()


@given(worlds(), st.sampled_from(RANGES))
def test_scan_matches_the_double_loop(state, lidar_range):
    trees, position = state
    seen = F.scan(trees, position, F.sight_lines(lidar_range))
    assert seen.dtype == torch.bool
    assert cells_of(seen) == oracles.scan(trees.tolist(), at(position), lidar_range)


@given(worlds(), st.sampled_from(RANGES))
def test_scan_sees_nothing_beyond_the_range_or_behind_a_trunk(state, lidar_range):
    trees, position = state
    start = at(position)
    for cell in cells_of(F.scan(trees, position, F.sight_lines(lidar_range))):
        assert math.dist(cell, start) <= lidar_range
        offset = (cell[0] - start[0], cell[1] - start[1])
        line = [oracles.add(start, step) for step in oracles.sight_line(offset)]
        assert not any(trees[between] for between in line)


@given(worlds())
def test_scan_sees_the_agent_and_its_eight_neighbours(state):
    trees, position = state
    seen = cells_of(F.scan(trees, position, F.sight_lines(1.5)))
    assert {at(position), *oracles.neighbours(trees.tolist(), at(position))} <= seen


@given(worlds(), st.data())
def test_scan_does_not_depend_on_trunks_out_of_range(state, data):
    trees, position = state
    near = F.scan(torch.zeros_like(trees), position, F.sight_lines(2.5))
    bits = data.draw(st.lists(st.booleans(), min_size=trees.numel(), max_size=trees.numel()))
    others = torch.where(near, trees, torch.tensor(bits).reshape(trees.shape))
    lines = F.sight_lines(2.5)
    assert torch.equal(F.scan(trees, position, lines), F.scan(others, position, lines))


@given(worlds())
def test_scan_turns_with_the_arena(state):
    trees, position = state
    lines = F.sight_lines(5.0)
    seen = F.scan(turned(trees), turned_position(position, trees.shape[-1]), lines)
    assert torch.equal(seen, turned(F.scan(trees, position, lines)))


@pytest.mark.parametrize("batch", BATCHES)
def test_scans_of_a_stack_are_the_stack_of_scans(batch):
    trees, _, position = explored_states(1, batch)
    lines = F.sight_lines(5.0)
    assert_batched_equals_singles(lambda t, p: F.scan(t, p, lines), trees, position, batch=batch)


def test_a_revealed_map_takes_the_true_state_and_keeps_it_for_ever():
    trees, position = world("""
        A . T .
        . . . .
    """)
    before = parse_cells("""
        ? ? ? .
        ? . ? ?
    """)
    after, new_cells = F.reveal(trees, before, position, F.sight_lines(2.0))
    # Seen: (0, 0), (0, 1), (0, 2), (1, 0), (1, 1), the last known before; (1, 2) is sqrt(5) away.
    assert draw(after) == ". . T .\n. . ? ?"
    assert new_cells.tolist() == [4.0] and new_cells.dtype == torch.float32
    assert after.dtype == torch.uint8
    assert draw(before) == "? ? ? .\n? . ? ?"  # a new map, not the old one


@given(worlds())
def test_a_second_look_from_the_same_place_reveals_nothing(state):
    trees, position = state
    lines = F.sight_lines(5.0)
    first, count = F.reveal(trees, torch.zeros_like(trees, dtype=torch.uint8), position, lines)
    second, none = F.reveal(trees, first, position, lines)
    assert torch.equal(first, second)
    assert count.item() == (first != F.Cell.UNKNOWN).sum() and none.item() == 0
