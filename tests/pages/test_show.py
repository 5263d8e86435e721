"""``forestrl show``: one page, of one policy or of several side by side."""

import pytest

from forestrl.pages import read_episodes
from forestrl.pages.page import unpacked
from tests.commands import forestrl

TINY = ("env=tiny", "show.steps=12", "show.arena=2")
LIMIT = 2_000_000  # bytes


def shown(folder, *settings):
    result = forestrl("show", *TINY, f"hydra.run.dir={folder}", *settings)
    assert result.status == 0, result.err
    page = folder / "episode.html"
    assert str(page) in result.out
    return read_episodes(page.read_text())


def test_policies_are_shown_side_by_side_in_the_same_arena(tmp_path):
    found = shown(tmp_path, "policy=paper", "show.beside=[path_gain,nearest_frontier]")
    assert list(found) == ["paper", "path_gain", "nearest_frontier"]
    assert len({recording.trees.tobytes() for recording in found.values()}) == 1
    assert len({recording.moments[0].agent for recording in found.values()}) == 1
    assert found["paper"].moments[0].probability is not None
    assert found["path_gain"].moments[0].considered.cells


def test_an_arena_need_not_be_square_nor_have_a_filter(tmp_path):
    (recording,) = shown(tmp_path, "policy=random", "env.size=[9,21]", "safety=none").values()
    assert recording.trees.shape == (9, 21) and not recording.has_filter


def test_the_page_says_how_it_was_made(tmp_path):
    shown(tmp_path, "policy=nearest_frontier")
    facts = dict(unpacked((tmp_path / "episode.html").read_text())["about"])
    assert facts["command"].startswith("forestrl show env=tiny show.steps=12 show.arena=2")
    assert facts["test arena"] == "2, seed 0"


def test_a_policy_is_shown_once(tmp_path):
    words = ("show", *TINY, "policy=cost", "show.beside=[cost]", f"hydra.run.dir={tmp_path}")
    result = forestrl(*words)
    assert result.status == 1 and "each policy is drawn once" in result.err


@pytest.mark.heavy
def test_a_long_episode_in_a_large_arena_stays_small(tmp_path):
    options = ("env.size=100", "env.n_trees=180", "show.steps=500", "show.beside=[paper]")
    shown(tmp_path, "policy=path_gain", *options)
    assert (tmp_path / "episode.html").stat().st_size < LIMIT
