"""GIFs: they give the pictures back, keep the colours, and take no more memory when longer."""

import gc

import numpy as np
import pytest
from PIL import Image

from forestrl.evaluation import arenas, uniforms
from forestrl.rendering import draw_frame, play, write_gif
from forestrl.rendering import panel as P
from tests.evaluation.policies import forest, random_action
from tests.rendering.scenes import count, scene


def pictures(steps, every=1):
    """Pictures of an episode, drawn as they are asked for."""
    env = forest(1, size=20, coverage_goal=1.0)
    draws = uniforms(0, [1], steps)
    td = arenas.draw_arenas(env, 0, [1])
    for each in play(env, random_action, td, steps=steps, every=every, uniforms=draws):
        yield draw_frame(each, 4)


def test_a_gif_gives_the_pictures_back(tmp_path):
    drawn = list(pictures(40, 4))
    path = write_gif(drawn, tmp_path / "episode.gif", fps=8)
    with Image.open(path) as gif:
        assert gif.n_frames == len(drawn) == 11 and gif.size == drawn[0].size
        assert gif.info["duration"] == 120 and gif.info["loop"] == 0  # 125 ms, rounded to even
        for i, picture in enumerate(drawn):
            gif.seek(i)
            error = np.asarray(gif.convert("RGB")).astype(int) - np.asarray(picture)
            assert np.abs(error).mean() < 1.0, i  # of 255, from the palette
        assert gif.info["duration"] > 1000  # a pause before it starts again
    assert [file.name for file in tmp_path.iterdir()] == ["episode.gif"]


def counted(drawn, counts):
    """Passes pictures on; every twentieth time, all that live in this process are counted."""
    for i, picture in enumerate(drawn):
        if i % 20 == 19:
            gc.collect()
            counts.append(sum(issubclass(type(each), Image.Image) for each in gc.get_objects()))
        yield picture


def test_no_picture_is_kept(tmp_path):
    counts = []
    write_gif(counted(pictures(99), counts), tmp_path / "a.gif", fps=8)
    assert len(counts) == 5 and max(counts) <= counts[0]


def test_pictures_that_do_not_change_are_shown_as_long_as_others(tmp_path):
    same = draw_frame(scene())
    with Image.open(write_gif([same] * 5, tmp_path / "a.gif", fps=10)) as gif:
        assert gif.n_frames == 5
        first = gif.convert("RGB").tobytes()
        for i in range(5):
            gif.seek(i)
            assert gif.convert("RGB").tobytes() == first
            assert gif.info["duration"] == (100 if i < 4 else 1600)


COLOURS = sorted({value for name, value in vars(P).items() if name.isupper() and name != "_FINE"})


def test_a_gif_keeps_the_colours_that_are_drawn_with(tmp_path):
    stripes = Image.new("RGB", (len(COLOURS), 3))
    for i, colour in enumerate(COLOURS):
        stripes.paste(colour, (i, 0, i + 1, 3))
    with Image.open(write_gif([stripes, stripes], tmp_path / "a.gif", fps=2)) as gif:
        shown = gif.convert("RGB")
    assert len(COLOURS) > 12
    assert [shown.getpixel((i, 1)) for i in range(len(COLOURS))] == COLOURS
    assert count(shown, P.VEILED) == 3


def failing(drawn):
    yield from drawn
    raise RuntimeError("the episode broke off")


def test_a_gif_is_whole_or_not_there(tmp_path):
    small, large = Image.new("RGB", (4, 4)), Image.new("RGB", (5, 4))
    for drawn, fps, error, message in (
        ([], 5, ValueError, "one size"),
        ([small, large], 5, ValueError, r"one size .*\(4, 4\), \(5, 4\)"),
        ([small, small], 0, ValueError, "fps=0"),
        (failing([small, small, small]), 5, RuntimeError, "broke off"),
    ):
        with pytest.raises(error, match=message):
            write_gif(drawn, tmp_path / "a.gif", fps)
        assert not list(tmp_path.iterdir())
