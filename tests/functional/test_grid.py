"""Cells, gathering with a value for outside, and window counts."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from forestrl import functional as F
from tests import oracles
from tests.drawing import parse_cells, situation
from tests.states import BATCHES, assert_batched_equals_singles, masks, random_state


def test_cells_are_unknown_free_or_occupied_in_this_order():
    assert [(cell.name, int(cell)) for cell in F.Cell] == [
        ("UNKNOWN", 0),
        ("FREE", 1),
        ("OCCUPIED", 2),
    ]


def test_gather_reads_row_and_col():
    grid = torch.arange(6).reshape(2, 3)  # [[0, 1, 2], [3, 4, 5]]
    index = torch.tensor([[0, 2], [1, 0], [1, 2]])
    assert F.gather(grid, index, -1).tolist() == [2, 3, 5]


def test_gather_answers_the_outside_value_beyond_each_border():
    grid = torch.arange(6).reshape(2, 3)
    index = torch.tensor([[-1, 0], [0, -1], [2, 0], [0, 3], [-1, -1], [2, 3], [50, 50], [1, 1]])
    assert F.gather(grid, index, 9).tolist() == [9, 9, 9, 9, 9, 9, 9, 4]


@pytest.mark.parametrize("outside", [True, False])
def test_gather_keeps_booleans(outside):
    grid = torch.tensor([[True, False]])
    answer = F.gather(grid, torch.tensor([[0, 0], [0, 1], [1, 0]]), outside)
    assert answer.dtype == torch.bool
    assert answer.tolist() == [True, False, outside]


def test_gather_keeps_the_codes_of_a_map():
    cells, _ = situation("A T ?")
    answer = F.gather(cells, torch.tensor([[0, 2], [0, 3]]), F.Cell.OCCUPIED)
    assert answer.dtype == torch.uint8
    assert answer.tolist() == [F.Cell.UNKNOWN, F.Cell.OCCUPIED]


def test_gather_leaves_the_grid_as_it_was():
    cells, _ = random_state(0)
    before = cells.clone()
    F.gather(cells, torch.tensor([[-3, 0], [1, 1]]), 2)
    assert torch.equal(cells, before)


@pytest.mark.parametrize("batch", BATCHES)
def test_gather_of_a_stack_is_the_stack_of_gathers(batch):
    cells, _ = random_state(1, batch, height=4, width=6)
    rng = torch.Generator().manual_seed(2)
    index = torch.randint(-2, 8, (*batch, 5, 2), generator=rng)
    assert_batched_equals_singles(lambda c, i: F.gather(c, i, 2), cells, index, batch=batch)


def test_window_counts_by_hand():
    mask = parse_cells("""
        T . . .
        . T . .
        . . . T
    """).eq(F.Cell.OCCUPIED)
    expected = [
        [2, 2, 1, 0],  # the corner sees the trees at (0, 0) and (1, 1)
        [2, 2, 2, 1],
        [1, 1, 2, 1],
    ]
    assert F.window_counts(mask, 3).tolist() == expected


def test_window_counts_are_cut_by_the_border():
    mask = torch.ones(3, 3, dtype=torch.bool)
    counts = F.window_counts(mask, 3)
    assert counts.tolist() == [[4, 6, 4], [6, 9, 6], [4, 6, 4]]
    assert counts.dtype == torch.int32


def test_a_window_of_one_cell_counts_the_cell_itself():
    mask = torch.tensor([[True, False], [False, True]])
    assert F.window_counts(mask, 1).tolist() == [[1, 0], [0, 1]]


def test_a_window_larger_than_the_arena_counts_the_whole_arena():
    mask = torch.ones(2, 3, dtype=torch.bool)
    assert F.window_counts(mask, 7).tolist() == [[6, 6, 6], [6, 6, 6]]


@given(masks(max_side=9), st.sampled_from([1, 3, 5, 7]))
def test_window_counts_match_the_double_loop(mask, window):
    counts = F.window_counts(mask, window)
    for row, col in oracles.all_cells(mask.tolist()):
        assert counts[row, col] == oracles.window_count(mask.tolist(), (row, col), window)


@pytest.mark.parametrize("batch", BATCHES)
def test_window_counts_of_a_stack_are_the_stack_of_counts(batch):
    cells, _ = random_state(3, batch, height=8, width=5)
    assert_batched_equals_singles(lambda m: F.window_counts(m, 5), cells == 1, batch=batch)
