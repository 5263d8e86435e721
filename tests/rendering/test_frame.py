"""A whole picture of one episode: nothing overlaps or is cut off, whatever the arena's shape."""

import pytest

from forestrl import keys as K
from forestrl.evaluation import arenas, uniforms
from forestrl.rendering import draw_frame, play
from forestrl.rendering import panel as P
from forestrl.rendering.layout import fitting_grid
from forestrl.rendering.scene import Trail
from forestrl.rendering.views import draw_arena, draw_decision, draw_map
from forestrl.status import Status
from tests.evaluation.policies import forest, random_logits
from tests.rendering.scenes import EAST, SCALE, SOUTH, SOUTH_WEST, acted, places, scene, step, word

SHAPES = [3, 8, 14, 50, 100, (20, 60), (60, 20), (3, 300), (300, 3), 300]


def scenes_of(shape, steps=3):
    env = forest(1, size=shape, n_trees=2, tree_radius=(0.5, 1.0), coverage_goal=1.0)
    td, draws = arenas.draw_arenas(env, 0, [0]), uniforms(0, [0], steps)
    return list(play(env, random_logits, td, steps=steps, uniforms=draws))


def parts(picture, *pictures):
    """The boxes of pictures that must each be there once, apart from one another."""
    boxes = []
    for part in pictures:
        ((left, top),) = places(part, picture)
        boxes.append((left, top, left + part.width, top + part.height))
    for i, one in enumerate(boxes):
        for other in boxes[:i]:
            across = min(one[2], other[2]) - max(one[0], other[0])
            down = min(one[3], other[3]) - max(one[1], other[1])
            assert across <= 0 or down <= 0
    return boxes


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_everything_is_there_once_and_apart(shape):
    for each in scenes_of(shape):
        picture = draw_frame(each)
        views = [
            draw(each, fitting_grid(2, each.cells.shape, 740, 440).scale)
            for draw in (draw_arena, draw_map)
        ]
        coverage = f"coverage {100 * each.coverage:.1f} %"
        large = [word(text) for text in ("Agent's map", "Decision", coverage, "interventions 0")]
        small = [word(text, 12) for text in ("known to be occupied", "replaced action")]
        boxes = parts(picture, *views, draw_decision(each), *large, *small)
        assert all(box[2] <= picture.width - 10 for box in boxes)
        assert any(says(each, "Arena", "Arena (hidden from the agent)"))


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_pictures_of_an_episode_have_one_size_that_a_screen_has_room_for(shape):
    ((width, height),) = {draw_frame(each).size for each in scenes_of(shape)}
    assert width <= 1500 and height <= 800


@pytest.mark.parametrize(
    ("shape", "columns", "scale"),
    [
        ((50, 50), 2, 7),  # 740 / 2 - 16 = 354
        ((100, 100), 2, 3),
        ((60, 20), 2, 6),  # 440 - 16 - 26 = 398
        ((20, 60), 1, 8),  # 440 / 2 - 16 - 26 = 178
        ((3, 300), 1, 2),
        ((300, 3), 2, 2),  # would be 1
        ((3, 3), 2, 32),  # would be 118
    ],
)
def test_views_are_as_large_as_fits_those_of_wide_arenas_below_one_another(shape, columns, scale):
    assert fitting_grid(2, shape, 740, 440) == (columns, scale)


def test_a_scale_may_be_given():
    assert places(draw_arena(scene(), 11), draw_frame(scene(), 11))


def edges(td):
    """The colour of the frames around arena and map."""
    picture = draw_frame(scene(td), SCALE)
    found = [places(draw(scene(td), SCALE), picture)[0] for draw in (draw_arena, draw_map)]
    return {picture.getpixel((left - 2, top - 2)) for left, top in found}


def test_the_frames_take_a_colour_when_something_happens():
    assert edges(step()) == edges(acted(EAST)) == edges(acted(EAST, EAST)) == {P.PAPER}
    assert edges(acted(SOUTH, SOUTH_WEST)) == {P.INTERVENTION}
    assert edges(acted(SOUTH)) == {P.COLLISION}


def says(shown, *texts, size=15):
    return [bool(places(word(text, size), draw_frame(shown))) for text in texts]


def test_the_legend_has_what_can_occur():
    filtered, bare = scene(acted(EAST, EAST)), scene(acted(EAST))
    words = ("filter stepped in", "replaced action", "collision")
    assert says(filtered, *words, size=12) == [True, True, False]
    assert says(bare, *words, size=12) == [False, False, True]
    graph = scene(acted(EAST).set(K.WAYPOINT, step()[K.POSITION]))
    assert says(graph, "graph edge", size=12) == [True]
    assert says(bare, "graph edge", size=12) == [False]


def test_without_a_filter_collisions_are_counted_and_else_interventions():
    two = Trail([], [], [(4, 1)], [(2, 0), (2, 0)])
    assert says(scene(acted(EAST), trail=two), "no filter, collisions 2") == [True]
    assert says(scene(acted(SOUTH), trail=two), "no filter, collisions 3") == [True]
    one = Trail([], [], [(4, 1)])
    assert says(scene(acted(SOUTH, SOUTH_WEST), trail=one), "interventions 2") == [True]
    assert says(scene(acted(EAST, EAST), trail=one), "interventions 1") == [True]


def test_a_collision_in_spite_of_a_filter_is_not_passed_over():
    td = acted(EAST, EAST)
    td["next"][K.COLLISION][:] = True
    assert says(scene(td), "collisions 1", "interventions 0") == [True, False]


@pytest.mark.parametrize(
    ("status", "goal", "said"),
    [
        (Status.EXPLORING, 0.9, ""),
        (Status.EXPLORING, 0.5, "50 % at step 12"),
        (Status.EXPLORING, 0.455, "45.5 % at step 12"),
        *(
            (each, 0.9, f"stopped: {each.name.lower()}".replace("_", " "))
            for each in list(Status)[1:]
        ),
    ],
)
def test_the_caption_says_how_it_ended_or_why_a_planner_stopped(status, goal, said):
    td = step().set(K.STATUS, step()[K.STEP_COUNT][0] * 0 + int(status))
    shown = scene(td, coverage_goal=goal)
    endings = [f"stopped: {each.name.lower()}".replace("_", " ") for each in list(Status)[1:]]
    endings += ["50 % at step 12", "45.5 % at step 12"]
    assert says(shown, *endings) == [ending == said for ending in endings]
