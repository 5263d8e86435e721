"""Worlds on the command line: evaluated, drawn, written as maps, and refused in one line."""

import re

import numpy as np
import pytest
import torch

from forestrl.build import make_forest
from forestrl.envs import MapFiles, StemPlot, read_map
from forestrl.evaluation.arenas import arena_generator, draw_arenas
from forestrl.functional import Cell
from forestrl.keys import POSITION, TREES
from tests.commands import compose, forestrl
from tests.envs.maps import DATA, save

SHORT = ("policy=nearest_frontier", "eval.arenas=2", "eval.steps=20")
WORLDS = ["forest", "poisson", "hard_core", "plantation", "stems", "map", "maps"]


@pytest.mark.parametrize("env", WORLDS[1:])
def test_every_world_is_evaluated_offline_and_says_what_it_rests_on(env, tmp_path):
    result = forestrl("eval", f"env={env}", *SHORT, f"hydra.run.dir={tmp_path}/out")
    assert result.status == 0, result.err
    assert result.err.startswith("world: ")
    assert re.search(r"collisions +0\n", result.out)


@pytest.mark.parametrize("env", ["stems", "map"])
def test_a_shipped_world_is_drawn_offline(env, tmp_path):
    words = ("render", f"env={env}", "policy=nearest_frontier", "render.steps=8")
    result = forestrl(*words, f"hydra.run.dir={tmp_path}/out")
    assert result.status == 0, result.err
    assert (tmp_path / "out/episode.gif").read_bytes().startswith(b"GIF89a")


@pytest.mark.parametrize("env", WORLDS)
def test_an_exported_world_is_the_arena_of_an_evaluation_and_reads_back_equal(env, tmp_path):
    words = (f"env={env}", "export.arena=3", "export.seed=7", f"hydra.run.dir={tmp_path}/out")
    result = forestrl("export", "what=map", *words)
    assert result.status == 0, result.err
    arena = draw_arenas(make_forest(compose("eval", f"env={env}"), 1), 7, [3])[0]
    grid = read_map(tmp_path / "out/map.yaml")
    assert np.array_equal(grid.cells != Cell.FREE, arena[TREES].numpy())
    x, y = map(float, re.search(r"env.start=\[(.+),(.+)\]", result.out).groups())
    assert grid.cell_at((x, y)) == tuple(arena[POSITION].tolist())
    again = MapFiles(tmp_path / "out/map.yaml", reduce=1, start=(x, y))
    trees, start = again.sample((), generator=torch.Generator())
    assert torch.equal(trees, arena[TREES]) and torch.equal(start, arena[POSITION])


def test_an_exported_part_lies_where_it_lay(tmp_path):
    words = ("env=stems", "export.image=png", f"hydra.run.dir={tmp_path}/out")
    assert forestrl("export", *words).status == 0
    grid = read_map(tmp_path / "out/map.yaml")
    whole, _ = StemPlot(size=None).draw_map(arena_generator(0, 0, "arena"))
    assert (tmp_path / "out/map.png").is_file() and grid.cell_size == 0.5
    for row, col in ((0, 0), (49, 49), (20, 7)):
        assert grid.cells[row, col] == whole.cells[whole.cell_at(grid.point_at(row, col))]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("eval env=stems env.path=none.csv", "none.csv: there is no such file$"),
        ("eval env=stems env.cell_size=0", "env.cell_size=0 is not allowed: .* more than 0"),
        ("eval env=stems env.robot_radius=-1", "env.robot_radius=-1 is not allowed"),
        ("eval env=stems env.size=2", "env.size=2 is not allowed: .*from 3 to 1000"),
        (
            "eval env=stems env.size=3 env.start=[0,0]",
            r"env.start=.* is not allowed",
        ),
        ("eval env=map env.path=3", "env.path=3 is not allowed: it must be a path"),
        ("eval env=map env.path=.", r"\.: there is no map in this folder"),
        ("eval env=map env.reduce=0", "env.reduce=0 is not allowed: .*from 1 to 100"),
        ("eval env=map env.reduce=100", r"aws_small_warehouse.yaml: no cell is free|metres|cells"),
        ("eval env=map env.mode=binary", "env.mode=binary .*trinary, scale or raw"),
        ("eval env=map env.free_thresh=0.7", "yaml: free_thresh: 0.7 is not allowed: .*most 0.65"),
        ("eval env=map env.start_cell=[0,0]", r"env.start_cell=\[0,0\] is not allowed: .*free"),
        ("render env=hard_core env.density=5000", "env.density=5000.* is not allowed: .*1343"),
        ("eval env=plantation env.dbh=[4,2]", r"env.dbh=\[4,2\] is not allowed: .*smallest"),
        ("export what=film", "what=film is not allowed: it must be map$"),
        ("export export.cell_size=0", "export.cell_size=0 is not allowed"),
        ("export env.lidar_range=3", "env.lidar_range is not read by this command"),
        ("collisions env=stems", "env.world=forestrl.envs.StemPlot .*varies env.size"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(words, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    policy = () if words.startswith(("export", "collisions")) else ("policy=random",)
    result = forestrl(*words.split(), *policy)
    assert result.status == 1
    (line,) = result.err.splitlines()
    assert re.search(message, line)


def test_a_files_field_keeps_its_name_in_the_message(tmp_path):
    """Though there is a setting env.resolution too, and a folder may be called beta=1."""
    folder = tmp_path / "beta=1"
    folder.mkdir()
    path = save(folder, [[255] * 4] * 4, resolution=0)
    words = ("eval", "env=map", f'env.path="{path}"', "policy=random")
    result = forestrl(*words, f"hydra.run.dir={tmp_path}/out")
    assert result.err == (
        f"forestrl eval: {path}: resolution: 0 is not allowed: it must be a number more than 0 and "
        "at most 1000\n"
    )


def test_a_dungeon_is_evaluated_from_its_image(tmp_path):
    image = DATA / "dungeons" / "medium_img_1.png"
    words = [
        *("env=map", f"env.path={image}", "env.resolution=0.1", "env.lidar_range=10"),
        *("env.occupied_thresh=0.4", "env.free_thresh=0.3", "env.start_colour=[255,216,0]"),
    ]
    result = forestrl("eval", *words, *SHORT, f"hydra.run.dir={tmp_path}/out")
    assert result.status == 0, result.err
    assert "arenas of 120 x 160 cells of 0.4 m" in result.err
    assert "assumed, as there is no YAML file: origin=[0.0,0.0,0.0], negate=0" in result.err
