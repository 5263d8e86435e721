"""Pictures: what is drawn where, and GIFs that give the frames back."""

import numpy as np
import pytest
import torch
from PIL import Image
from tensordict import TensorDict

from forestrl import keys as K
from forestrl.evaluation import arenas, uniforms
from forestrl.rendering import draw_frame, record_episode, write_gif
from forestrl.rendering import panel as P
from forestrl.rendering.frame import _GAP, _HEAD
from forestrl.rendering.scene import Scene
from forestrl.status import Status
from tests.drawing import situation
from tests.evaluation.policies import forest, random_action, random_logits

SCALE = 20
MAP = """
    ? ? ? ? ? ? ?
    ? ? ? ? ? ? ?
    . . . . . . ?
    . . . T . . ?
    . . . . . . .
    . . A . . . .
    . . T . . . T
"""
SIDE = 7


def state(**entries):
    cells, position = situation(MAP)
    td = TensorDict(
        {
            K.TREES: cells == 2,
            K.CELLS: cells,
            K.POSITION: position,
            K.COVERAGE: torch.tensor([0.5]),
            K.STEP_COUNT: torch.tensor([12]),
        }
    )
    return td.update(entries)


def colour(frame, panel, row, col):
    """The colour of the middle of a cell in the first or second panel."""
    left = _GAP + panel * (SIDE * SCALE + _GAP)
    return frame.getpixel((left + int((col + 0.5) * SCALE), _HEAD + int((row + 0.5) * SCALE)))


def test_cells_have_their_colours():
    frame = draw_frame(state(), scale=SCALE, lidar_range=1.0)
    assert colour(frame, 0, 3, 3) == P.TRUNK and colour(frame, 0, 0, 0) == P.GROUND
    assert colour(frame, 0, 5, 2) == colour(frame, 1, 5, 2) == P.AGENT
    assert colour(frame, 1, 0, 0) == P.UNKNOWN and colour(frame, 1, 3, 3) == P.OCCUPIED
    assert colour(frame, 1, 3, 1) == P.FREE and colour(frame, 1, 2, 1) == P.FRONTIER
    assert colour(frame, 1, 6, 2) == P.INFEASIBLE  # the middle of a cross
    assert colour(frame, 1, 5, 1) == P.FREE  # the middle of a circle


def test_way_and_marks_are_drawn():
    way = [(2, 0), (3, 0), (4, 1)]
    frame = draw_frame(state(), scale=SCALE, path=way, marks=[(3, 0)], lidar_range=1.0)
    assert colour(frame, 0, 2, 0) == colour(frame, 0, 4, 1) == P.AGENT
    assert colour(frame, 0, 3, 0) == P.MARK


def test_waypoints_are_filled_as_strongly_as_the_policy_likes_them():
    logits = torch.full((9,), -20.0)
    logits[5], logits[4] = 1.0, 0.0
    frame = draw_frame(state(logits=logits), scale=SCALE)
    likely, second, unlikely = (colour(frame, 1, *cell) for cell in [(5, 3), (5, 1), (4, 2)])
    assert likely[0] < second[0] < unlikely[0] == 255  # the more green, the less red


def test_an_intervention_turns_the_frames_purple():
    """South, action 7, is a tree; the filter takes 6 or 8."""
    feasible = torch.tensor([True] * 7 + [False, True])
    calm = state(action=torch.tensor(5)).set(K.FEASIBLE, feasible)
    stopped = state(action=torch.tensor(7)).set(K.FEASIBLE, feasible)
    unfiltered = state(action=torch.tensor(7))
    corner = (_GAP - 2, _HEAD - 2)
    frames = [draw_frame(td, scale=SCALE) for td in (calm, stopped, unfiltered)]
    assert [frame.getpixel(corner) for frame in frames] == [P.PAPER, P.MARK, P.PAPER]


def test_graph_edges_are_drawn_when_there_is_a_graph():
    bare = draw_frame(state(), scale=SCALE)
    graph = draw_frame(state().set(K.WAYPOINT, torch.zeros(30, dtype=torch.int64)), scale=SCALE)

    def edge_pixels(frame):
        panel = frame.crop((_GAP, _HEAD, 2 * _GAP + 2 * SIDE * SCALE, _HEAD + SIDE * SCALE))
        return (np.asarray(panel) == P.EDGE).all(-1).sum()

    assert edge_pixels(bare) == 0 and edge_pixels(graph) > 100


@pytest.mark.parametrize(("status", "more"), [(Status.EXPLORING, False), (Status.CYCLE, True)])
def test_the_caption_says_why_a_planner_stopped(status, more):
    def ink(td):
        frame = draw_frame(td, scale=2 * SCALE)
        caption = np.asarray(frame)[_HEAD + 2 * SIDE * SCALE + 4 :, : 2 * (_GAP + 2 * SIDE * SCALE)]
        return (caption == P.INK).all(-1).sum()

    planned = state().set(K.STATUS, torch.tensor(status, dtype=torch.int8))
    assert Scene(planned).stopped == ("cycle" if more else "")
    assert (ink(planned) > ink(state())) == more


@pytest.mark.parametrize(("size", "scale"), [(5, 4), (16, 7), (50, 7), (100, 4)])
def test_all_frames_of_an_episode_have_one_size(size, scale):
    env = forest(1, size=size, n_trees=size * size // 60)
    td = arenas.draw_arenas(env, 0, [0])
    frames = record_episode(env, random_logits, td, 9, 4, uniforms=uniforms(0, [0], 9), scale=scale)
    assert len(frames) == 4  # before steps 0, 4 and 8, and after the last
    assert len({frame.size for frame in frames}) == 1
    assert frames[0].width == 4 * _GAP + 2 * size * scale + 164 and frames[0].mode == "RGB"


def test_an_episode_needs_no_batch():
    env = forest(None)
    env.set_seed(0)

    def east(td):
        return td.set(K.ACTION, torch.tensor(5))

    assert len(record_episode(env, east, TensorDict(), 4, 2)) == 3


def test_a_gif_gives_the_frames_back(tmp_path):
    env = forest(1, size=20)
    td = arenas.draw_arenas(env, 0, [1])
    draws = uniforms(0, [1], 40)
    frames = record_episode(env, random_action, td, 40, 4, uniforms=draws)
    path = write_gif(frames, tmp_path / "episode.gif", fps=8)
    with Image.open(path) as gif:
        assert gif.n_frames == len(frames) == 11 and gif.size == frames[0].size
        assert gif.info["duration"] == 120 and gif.info["loop"] == 0  # 125 ms, rounded to even
        for i, frame in enumerate(frames):
            gif.seek(i)
            error = np.asarray(gif.convert("RGB")).astype(int) - np.asarray(frame)
            assert np.abs(error).mean() < 1.5, i  # of 255, from the palette
    assert [file.name for file in tmp_path.iterdir()] == ["episode.gif"]


def test_a_gif_keeps_the_colours_of_the_legend(tmp_path):
    frame = draw_frame(state(), scale=SCALE, lidar_range=1.0)
    with Image.open(write_gif([frame, frame], tmp_path / "a.gif", fps=2)) as gif:
        shown = gif.convert("RGB")
    assert colour(shown, 1, 2, 1) == P.FRONTIER and colour(shown, 1, 5, 2) == P.AGENT
    assert shown.getpixel((0, 0)) == P.PAPER


def test_a_gif_needs_frames_of_one_size_and_a_rate(tmp_path):
    small, large = Image.new("RGB", (4, 4)), Image.new("RGB", (5, 4))
    for frames, fps, message in (
        ([], 5, "one size"),
        ([small, large], 5, "one size"),
        ([small], 0, "fps=0"),
    ):
        with pytest.raises(ValueError, match=message):
            write_gif(frames, tmp_path / "a.gif", fps)
    assert not list(tmp_path.iterdir())
