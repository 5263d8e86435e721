"""Arenas out of maps: unknown cells, starts, parts, folders, and planners in all of them."""

import re
from functools import cache

import numpy as np
import pytest
import torch
from hypothesis import given
from torchrl.envs import Compose, TransformedEnv, check_env_specs

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import (
    ForestEnv,
    GridMap,
    MapFiles,
    MappedWorld,
    SafetyFilter,
    draw_map,
    read_map,
    write_map,
)
from forestrl.envs.worlds.mapped import SHIPPED
from forestrl.planners import (
    CostBased,
    Hindsight,
    InformationGain,
    NearestFrontier,
    PathGain,
    PotentialField,
    RandomWalk,
)
from tests.envs.maps import DATA, cells, drawing, drawn, save
from tests.states import seeded

ROOMS = """
    . . . . ? ? .
    . T . . ? T .
    . . . . ? ? .
    T T T T T T T
    . . . . . . .
"""


def world(text=ROOMS, cell_size=1.0, start=None, **options):
    return MappedWorld([drawn(text, cell_size, start=start, name="rooms")], **options)


def test_unknown_and_occupied_cells_are_not_traversable():
    trees, _ = world().sample((2, 3), generator=seeded(0))
    assert trees.shape == (2, 3, 5, 7)
    assert torch.equal(trees[1, 2], torch.from_numpy(drawn(ROOMS).cells != F.Cell.FREE))


@given(cells)
def test_an_unknown_cell_is_never_seen_as_free(cells):
    cells = np.pad(cells, 1, constant_values=int(F.Cell.UNKNOWN))
    cells[1, 1] = F.Cell.FREE
    env = ForestEnv(MappedWorld([GridMap(cells, 1.0)]), lidar_range=4.0, num_envs=4, seed=0)
    steps = env.rollout(30, break_when_any_done=False)
    seen_as_free = steps["next", K.CELLS] == F.Cell.FREE
    assert not (seen_as_free & torch.from_numpy(cells != F.Cell.FREE)).any()
    assert not torch.from_numpy(cells != F.Cell.FREE)[steps["next", K.POSITION].unbind(-1)].any()
    assert (steps["next", K.TRAVERSABLE] <= torch.from_numpy(cells == F.Cell.FREE)).all()


def test_the_start_is_drawn_in_the_largest_component():
    """Of 12, 7 and 3 cells: the upper left room, without the trunk."""
    _, start = world().sample((200,), generator=seeded(0))
    places = {tuple(cell) for cell in start.tolist()}
    assert places == {(r, c) for r in range(3) for c in range(4)} - {(1, 1)}


def test_the_start_is_where_the_user_says():
    for options in ({"start": (6.5, 2.5)}, {"start_cell": (2, 6)}):
        _, start = world(**options).sample((3,), generator=seeded(0))
        assert start.tolist() == [[2, 6]] * 3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"start_cell": (1, 1)}, r"start_cell=\[1,1\] is not allowed: .*is occupied"),
        ({"start_cell": (0, 4)}, r"start_cell=\[0,4\] is not allowed: .*is unknown"),
        ({"start_cell": (5, 0)}, r"start_cell=\[5,0\] is not allowed: .*is outside"),
        (
            {"start": (1.5, 3.5)},
            r"start=\[1.5,3.5\] .*\[1,1\] of \[5,7\] in rooms is occupied",
        ),
        ({"start": (-3.0, 0.0)}, r"start=\[-3.0,0.0\] is not allowed: .*is outside"),
        ({"start_cell": (0, 0), "size": 3}, r"start_cell=\[0,0\] is not allowed: .*corner"),
        ({"corner": (5.0, 0.0), "size": 3}, r"corner=\[5.0,0.0\] is not allowed: .*not inside"),
    ],
)
def test_a_start_or_a_part_that_makes_no_sense_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        world(**options)


def test_a_part_is_where_the_user_says():
    part = world(size=(3, 4), corner=(3.0, 1.0), cell_size=1.0)
    grid, _ = part.draw_map(seeded(0))
    assert drawing(grid) == ". ? T .\n. ? ? .\nT T T T"
    assert grid.origin == (3.0, 1.0, 0.0)


def test_parts_are_drawn_where_enough_is_free():
    """Of 3 x 3 cells; the one with the most has 9 free ones."""
    map_ = ". . . ? ? . T\n. . . ? ? . .\n. . . ? ? T T"
    trees, _ = world(map_, size=3).sample((300,), generator=seeded(0))
    assert {int(free) for free in (~trees).flatten(1).sum(1)} == {9, 6}
    whole = world(map_, size=(3, 7)).sample((4,), generator=seeded(0))[0]
    assert torch.equal(whole[0], whole[3])


def test_an_arena_larger_than_the_map_is_unknown_around_it():
    grid, start = world(". .", size=(3, 4)).draw_map(seeded(0))
    assert drawing(grid) == "? ? ? ?\n? ? ? ?\n. . ? ?"
    assert start[0] == 2


def test_a_map_without_a_free_cell_is_refused():
    with pytest.raises(ValueError, match=r"rooms: no cell is free in an arena of \[3,3\] cells"):
        world("? T ?\nT T T\n? ? ?")


@pytest.mark.parametrize("shape", [(2, 9), (9, 1001)])
def test_a_map_that_is_no_arena_is_refused(shape):
    grid = GridMap(np.ones(shape, np.uint8), 1.0, name="sheet")
    with pytest.raises(ValueError, match=r"sheet: cells: \[\d+,\d+\] is not allowed: .*3 to 1000"):
        MappedWorld([grid])


def test_draws_follow_the_generator_and_nothing_else():
    source = world(size=3)
    first, again, other = (source.sample((20,), generator=seeded(seed)) for seed in (4, 4, 5))
    assert all(map(torch.equal, first, again)) and not torch.equal(first[1], other[1])
    grid, start = draw_map(source, seeded(4))
    trees, position = source.sample((), generator=seeded(4))
    assert np.array_equal(grid.free, ~trees.numpy()) and torch.equal(start, position)


def test_a_file_becomes_an_arena_of_coarser_cells(tmp_path):
    pixels = np.full((6, 8), 254, np.uint8)
    pixels[1, 6] = 0
    source = MapFiles(save(tmp_path, pixels), reduce=2, start=(1.5, -1.5))
    assert (source.shape, source.cell_size) == ((3, 4), 1.0)
    trees, start = source.sample((), generator=seeded(0))
    assert trees.nonzero().tolist() == [[0, 3]] and start.tolist() == [2, 0]
    wide = MapFiles(save(tmp_path, pixels), reduce=2, robot_radius=0.6)
    assert wide.sample((), generator=seeded(0))[0].nonzero().tolist() == [
        [0, 2],
        [0, 3],
        [1, 2],
        [1, 3],
    ]


@pytest.mark.parametrize("path", [DATA / "lse_arena.yaml", DATA / "turtlebot3_world.yaml", None])
def test_a_robots_map_goes_through_a_world_and_comes_back_cell_for_cell(path, tmp_path):
    original = read_map(path or SHIPPED / "maps/aws_small_warehouse.yaml")
    grid, _ = draw_map(MapFiles(path, reduce=1), seeded(0))
    write_map(tmp_path / "map.yaml", grid)
    assert np.array_equal(read_map(tmp_path / "map.yaml").cells, original.cells)
    again, _ = draw_map(MapFiles(tmp_path / "map.yaml", reduce=1), seeded(0))
    assert np.array_equal(again.cells, original.cells) and again.origin == original.origin


@pytest.fixture
def folder(tmp_path):
    """Two maps of different shapes."""
    for name, text in (("high", ". .\n. .\n. .\nT ."), ("wide", "T . . . .\n. . . . .\n. . . . T")):
        write_map(tmp_path / f"{name}.yaml", drawn(text, 0.5))
    return tmp_path


def test_of_a_folder_each_map_is_drawn_as_often(folder):
    source = MapFiles(folder, reduce=1)
    trees, _ = source.sample((400,), generator=seeded(0))
    assert source.shape == (4, 5)
    high = (trees[:, 3, 0] & trees[:, 0, 4]).sum()
    assert 160 < high < 240  # 200 expected, standard deviation 10
    assert re.match(
        rf"2 maps in {folder}: arenas of 4 x 5 cells of 0.5 m; \d+ unknown", source.describe()
    )


def test_of_a_folder_all_maps_have_one_cell_size(folder):
    write_map(folder / "xtra.yaml", drawn(". . .", 0.4))
    with pytest.raises(ValueError, match=r"xtra.yaml: metres of a cell: 0.4 is not allowed"):
        MapFiles(folder, reduce=1)


def test_what_is_assumed_of_an_image_is_said():
    image = DATA / "dungeons" / "easy_img_1.png"
    said = MapFiles(image, resolution=0.1, free_thresh=0.3, occupied_thresh=0.4).describe()
    assert "blocks of 4 x 4 cells are one, occupied if any in it is" in said
    assert "assumed, as there is no YAML file: origin=[0.0,0.0,0.0], negate=0, mode=trinary" in said
    assert "as given: resolution=0.1, occupied_thresh=0.4, free_thresh=0.3" in said


def test_two_ways_to_say_the_start_are_one_too_many(folder):
    with pytest.raises(ValueError, match=r"start_cell=\[0,0\] is not allowed: start is given too"):
        MapFiles(folder, start=(0.0, 0.0), start_cell=(0, 0))


def test_an_env_in_the_shipped_map_keeps_its_specs():
    env = ForestEnv(MapFiles(), num_envs=2, seed=0)
    assert env.world.shape == (106, 72)
    check_env_specs(env)


LIDAR = 10.0  # cells of 8 x 8 pixels
PLANNERS = {
    "random": RandomWalk,
    "nearest": NearestFrontier,
    "gain": lambda: InformationGain(),
    "path_gain": lambda: PathGain(lidar_range=LIDAR),
    "cost": lambda: CostBased(variant="corrected"),
    "mmpf": lambda: PotentialField(variant="corrected"),
    "hindsight": lambda: Hindsight(lidar_range=LIDAR, iterations=20),
}


@cache
def dungeon(kind):
    return MapFiles(
        DATA / "dungeons" / f"{kind}_img_1.png",
        reduce=8,
        resolution=0.1,
        occupied_thresh=0.4,
        free_thresh=0.3,
        start_colour=(255, 216, 0),
    )


@pytest.mark.heavy
@pytest.mark.parametrize("kind", ["easy", "medium", "complex"])
@pytest.mark.parametrize("name", PLANNERS)
def test_planners_explore_dungeons_without_a_collision(name, kind):
    source = dungeon(kind)
    assert source.shape == (60, 80)
    forest = ForestEnv(source, lidar_range=LIDAR, num_envs=1, seed=0)
    env = TransformedEnv(forest, Compose(SafetyFilter()))
    policy, td = PLANNERS[name](), env.reset()
    first = td[K.COVERAGE].item()
    assert F.gather(td[K.TREES], td[K.POSITION].unsqueeze(-2), outside=True).logical_not().all()
    for draw in torch.rand(30, 1, generator=seeded(0)):
        td = env.step(policy(td.set(K.UNIFORM, draw)))["next"].exclude("reward")
        assert not td[K.COLLISION].any()
    assert td[K.COVERAGE].item() > first or name == "random"
