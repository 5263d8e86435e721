"""Maps in metres: where cells lie, coarser cells, room for a robot, parts."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forestrl.envs import GridMap
from forestrl.functional import Cell
from tests.envs.maps import cells, drawing, drawn, origins

MAP = """
    . . T . ?
    . . . . .
    T . . . .
"""


def test_the_first_row_has_the_largest_y():
    grid = drawn(MAP, cell_size=0.5, origin=(10.0, -1.0, 0.0))
    assert grid.shape == (3, 5)
    assert grid.point_at(2, 0) == (10.25, -0.75)
    assert grid.point_at(0, 4) == (12.25, 0.25)
    assert grid.cell_at((10.25, -0.75)) == (2, 0)
    assert grid.cell_at((10.5, -0.5)) == (1, 1)  # an edge belongs to the cell above and beyond
    assert grid.cell_at((9.9, 0.6)) == (-1, -1)


def test_a_turned_map_is_turned_about_its_lower_left_corner():
    """A quarter turn counter-clockwise: along the rows is up, up the columns is to the left."""
    grid = drawn(MAP, origin=(0.0, 0.0, math.pi / 2))
    assert grid.point_at(2, 4) == pytest.approx((-0.5, 4.5))
    assert grid.cell_at((-2.5, 0.5)) == (0, 0)


@given(cells, origins, st.floats(0.01, 5), st.data())
def test_a_cells_middle_lies_in_the_cell(cells, origin, cell_size, data):
    grid = GridMap(cells, cell_size, origin)
    row, col = (data.draw(st.integers(-3, side + 3)) for side in grid.shape)
    assert grid.cell_at(grid.point_at(row, col)) == (row, col)


def test_blocks_are_counted_from_the_lower_left_corner_and_lose_nothing():
    grid = drawn(MAP, cell_size=0.5, origin=(10.0, -1.0, 0.0)).reduced(2)
    assert drawing(grid) == "? T ?\nT . ?"
    assert (grid.cell_size, grid.origin) == (1.0, (10.0, -1.0, 0.0))


@given(cells, st.integers(1, 5), origins)
def test_a_coarser_map_is_conservative(cells, factor, origin):
    """Whatever lies at a point in the fine map: the coarse cell there is no better than it."""
    fine = GridMap(cells, 0.25, origin)
    coarse = fine.reduced(factor)
    found = {state: 0 for state in Cell}
    for row, col in np.ndindex(fine.shape):
        there = coarse.cells[coarse.cell_at(fine.point_at(row, col))]
        state = fine.cells[row, col]
        assert there == Cell.OCCUPIED or state != Cell.OCCUPIED
        assert there != Cell.FREE or state == Cell.FREE
        found[Cell(there)] += state == there
    for state in (Cell.OCCUPIED, Cell.FREE):  # and not of nothing
        assert found[state] > 0 or not (coarse.cells == state).any()


@given(cells, st.floats(0, 2.5))
def test_a_robot_has_no_room_where_an_obstacle_is_within_its_radius(cells, radius):
    grid = GridMap(cells, 0.5)
    room = grid.inflated(radius)
    obstacles = np.argwhere(cells == Cell.OCCUPIED)
    for row, col in np.ndindex(grid.shape):
        gaps = [
            0.5 * math.hypot(max(abs(row - r) - 0.5, 0), max(abs(col - c) - 0.5, 0))
            for r, c in obstacles.tolist()
        ]
        state = cells[row, col]
        near = state == Cell.FREE and min(gaps, default=math.inf) <= radius
        assert room.cells[row, col] == (Cell.OCCUPIED if near else state)


@given(cells, origins, st.data())
def test_a_part_of_a_map_lies_where_it_lay(cells, origin, data):
    grid = GridMap(cells, 0.3, origin).padded((4, 4))
    row, col = (data.draw(st.integers(0, side - 2)) for side in grid.shape)
    part = grid.window(row, col, (2, 2))
    assert part.point_at(1, 0) == pytest.approx(grid.point_at(row + 1, col), abs=1e-9)
    assert np.array_equal(part.cells, grid.cells[row : row + 2, col : col + 2])


def test_what_is_added_to_a_map_is_unknown_and_above_and_to_the_right():
    assert drawing(drawn("T .").padded((2, 3))) == "? ? ?\nT . ?"
    assert drawing(drawn("T .").padded((1, 1))) == "T ."
