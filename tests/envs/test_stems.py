"""Measured forests: where trunks stand, and what is refused."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torchrl.envs import check_env_specs

from forestrl import functional as F
from forestrl.envs import ForestEnv, StemPlot
from forestrl.envs.worlds.stems import Stems, read_stems, stem_map
from tests.envs.maps import drawing
from tests.states import seeded

HEAD = "x_m,y_m,dbh_cm\n"


def plot(tmp_path, *rows, head=HEAD):
    path = tmp_path / "plot.csv"
    path.write_text(head + "\n".join(rows))
    return path


@pytest.fixture
def corners(tmp_path):
    """Four trunks of 20 cm in the corners of 4 x 3 m, that in the upper right of 60 cm."""
    return plot(tmp_path, "10.0,5.0,20", "14.0,5.0,20", "10.0,8.0,20", "14.0,8.0,60")


def test_trunks_stand_where_they_were_measured(corners):
    """Radii of 0.1 and 0.3 m about the corners of the box: of each a quarter is inside."""
    grid = stem_map(read_stems(corners), cell_size=0.5)
    assert (grid.shape, grid.origin, grid.cell_size) == ((6, 8), (10.0, 5.0, 0.0), 0.5)
    assert drawing(grid).splitlines()[0] == "T . . . . . . T"
    assert np.argwhere(~grid.free).tolist() == [[0, 0], [0, 7], [5, 0], [5, 7]]


def test_trunks_grow_by_the_robots_radius(corners):
    """To 0.35 and 0.55 m: the thick one now reaches the next cells, but not that across."""
    grid = stem_map(read_stems(corners), cell_size=0.5, robot_radius=0.25)
    assert np.argwhere(~grid.free)[:4].tolist() == [[0, 0], [0, 6], [0, 7], [1, 7]]


@given(st.lists(st.tuples(*[st.floats(0, 8)] * 2, st.floats(0.02, 0.8)), min_size=2, max_size=6))
def test_a_cell_is_occupied_where_any_part_of_a_trunk_is_in_it(stems):
    """Against the distance of each cell's nearest point, one by one."""
    table = np.array(stems)
    grid = stem_map(Stems(table[:, :2], table[:, 2]), cell_size=0.4, robot_radius=0.1)
    for row, col in np.ndindex(grid.shape):
        x, y = grid.point_at(row, col)
        gaps = [
            math.hypot(max(abs(x - a) - 0.2, 0), max(abs(y - b) - 0.2, 0)) - r - 0.1
            for a, b, r in stems
        ]
        if abs(min(gaps)) > 1e-6:  # a rim on an edge may be either
            assert (grid.cells[row, col] == F.Cell.OCCUPIED) == (min(gaps) < 0)


def test_thin_trunks_are_not_lost_in_coarse_cells(corners):
    assert (~stem_map(read_stems(corners), cell_size=1.0).free).sum() == 4


def test_other_columns_and_their_order_are_let_be(tmp_path):
    path = plot(tmp_path, "oak,20,1,2", "fir,30,3,4", head="species,dbh_cm,x_m,y_m\n")
    stems = read_stems(path)
    assert stems.place.tolist() == [[1, 2], [3, 4]] and stems.radius.tolist() == [0.1, 0.15]


def test_the_shipped_plot_gives_parts_that_a_seed_draws():
    source = StemPlot()
    assert (source.shape, source.cell_size) == ((50, 50), 0.5)
    trees, start = source.sample((20,), generator=seeded(1))
    again, _ = source.sample((20,), generator=seeded(1))
    assert torch.equal(trees, again) and not torch.equal(trees[0], trees[1])
    largest = F.largest_component(~trees)
    assert F.gather(largest, start.unsqueeze(-2), outside=False).all()
    assert "872 trunks on 101.5 x 102.2 m, the box around them" in source.describe()
    check_env_specs(ForestEnv(source, num_envs=2, seed=0))


def test_the_whole_plot_and_a_fixed_part():
    whole = StemPlot(size=None)
    assert whole.shape == (205, 204)
    grid, _ = whole.draw_map(seeded(0))
    part, start = StemPlot(size=(20, 30), corner=(40.0, 30.0), start=(42.0, 31.2)).draw_map(
        seeded(0)
    )
    row, col = grid.cell_at((40.0, 30.0))
    assert np.array_equal(part.cells, grid.cells[row - 19 : row + 1, col : col + 30])
    assert part.cell_at((42.0, 31.2)) == tuple(start.tolist())


def test_a_start_in_a_trunk_is_refused():
    thick = read_stems(StemPlot().path)
    x, y = thick.place[thick.radius.argmax()].round(2).tolist()
    with pytest.raises(ValueError, match=r"start=\[.*\] is not allowed: it must be free.*occupied"):
        StemPlot(size=None, start=(x, y))


FINE = ("0,0,20", "50,50,20")


@pytest.mark.parametrize(
    ("head", "rows", "message"),
    [
        ("x,y,dbh\n", FINE, r"plot.csv: columns: \[x,y,dbh\] is not allowed: x_m must be one of"),
        ("x_m,y_m\n", FINE, r"plot.csv: columns: \[x_m,y_m\] is not allowed: dbh_cm must be"),
        ("", (), r"plot.csv: columns: \[\] is not allowed"),
        (HEAD, (), "plot.csv: there are no stems in it"),
        (HEAD, ("0,0,20", "1,oak,20"), "plot.csv: line 3: y_m: oak is not allowed: .* a number"),
        (HEAD, ("0,0,20", "1,2"), "plot.csv: line 3: dbh_cm: null is not allowed"),
        (HEAD, ("0,0,20", "1,nan,20"), "plot.csv: line 3: y_m: nan is not allowed"),
        (HEAD, ("0,0,0",), "plot.csv: line 2: dbh_cm: 0 is not allowed: .* more than 0"),
        (HEAD, ("0,0,-4",), "plot.csv: line 2: dbh_cm: -4 is not allowed: .* more than 0"),
        (HEAD, ("0,0,200", "1,1,20"), "plot.csv: dbh_cm: 200.0 is not allowed: .*in centimetres"),
        (HEAD, ("0,0,2000", "50,50,900"), "plot.csv: dbh_cm: 2000.0 is not allowed: .*in metres"),
        (HEAD, ("0,0,0.2", "50,50,0.3"), "plot.csv: dbh_cm: 0.3 is not allowed: no trunk is thick"),
        (
            HEAD,
            ("0,0,20", "1000000,1000000,20"),
            "plot.csv: metres of a cell: 0.5 is not allowed: 1e\\+06 x 1e\\+06 m",
        ),
        ("\x00,\n", FINE, "plot.csv"),
    ],
)
def test_a_plot_that_makes_no_sense_is_refused_by_name_place_and_value(
    head, rows, message, tmp_path
):
    path = plot(tmp_path, *rows, head=head)
    with pytest.raises(ValueError, match=message) as refusal:
        StemPlot(path)
    assert len(str(refusal.value).splitlines()) == 1


def test_a_plot_that_is_not_there_or_not_text_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none.csv: there is no such file"):
        StemPlot(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(ValueError, match=r"bytes.csv is not CSV"):
        StemPlot(tmp_path / "bytes.csv")
