"""``forestrl render``: files that are whole, of one policy or of several side by side."""

import pytest
from PIL import Image

from forestrl import keys as K
from forestrl.evaluation import arenas
from forestrl.evaluation.picture import Player, draw_episode
from forestrl.planners import CostBased, NearestFrontier
from forestrl.rendering import draw_frame, draw_side_by_side, in_step, play
from tests.commands import forestrl
from tests.envs.worlds import forest_env
from tests.evaluation.policies import forest

ARENA = {"size": 14, "n_trees": 4, "tree_radius": (1.0, 1.5)}  # env=tiny
TINY = ("env=tiny", "render.steps=12", "render.arena=2", "render.frames=true")


def draw(folder, *settings):
    result = forestrl("render", *TINY, f"hydra.run.dir={folder}", *settings)
    assert result.status == 0, result.err
    return [Image.open(path).copy() for path in sorted((folder / "frames").glob("*.png"))]


def arena(env):
    return arenas.draw_arenas(env, 0, [2])


def test_one_policy_is_drawn_with_its_decisions(tmp_path):
    drawn = draw(tmp_path, "policy=nearest_frontier", "render.every=5")
    env = forest(1, max_frontiers=256, **ARENA)
    scenes = play(env, NearestFrontier(), arena(env), steps=12, every=5)
    assert drawn == [draw_frame(scene) for scene in scenes] and len(drawn) > 1
    with Image.open(tmp_path / "episode.gif") as gif:
        assert gif.n_frames == len(drawn) and gif.size == drawn[0].size


def test_policies_are_drawn_side_by_side_in_the_same_arena_each_with_its_settings(tmp_path):
    options = ("policy=cost", "policy.variant=corrected", "render.beside=[nearest_frontier]")
    drawn = draw(tmp_path, *options, "env.coverage_goal=0.9", "safety=none", "render.every=4")
    env = forest_env(num_envs=1, coverage_goal=0.9, **ARENA)
    policies = {"cost": CostBased("corrected"), "nearest_frontier": NearestFrontier()}
    plays = {n: play(env, p, arena(env), steps=12, every=4) for n, p in policies.items()}
    assert drawn == [draw_side_by_side(scenes, 12) for scenes in in_step(plays)]
    assert len(drawn) > 1


def test_policies_that_sample_and_that_learned_can_stand_beside(tmp_path):
    drawn = draw(tmp_path, "policy=random", "render.beside=[nearest_frontier,learned]")
    assert len(drawn) == 4 and len({picture.size for picture in drawn}) == 1


def test_a_policy_of_ones_own_can_stand_beside(tmp_path):
    (tmp_path / "mine/policy").mkdir(parents=True)
    text = "name: careful\n_target_: forestrl.planners.RandomWalk\n"
    (tmp_path / "mine/policy/careful.yaml").write_text(text)
    place = f"hydra.searchpath=[file://{tmp_path}/mine]"
    assert len(draw(tmp_path, "policy=random", "render.beside=[careful]", place)) > 1


@pytest.mark.parametrize(
    ("beside", "expected"),
    [
        ("[nowhere]", "nowhere"),
        ("[random,nearest_frontier]", "random is drawn already"),
        ("[learned,learned]", "each policy is drawn once"),
    ],
)
def test_policies_that_cannot_stand_beside_are_refused_in_one_line(beside, expected, tmp_path):
    words = ("policy=random", f"render.beside={beside}", f"hydra.run.dir={tmp_path}")
    result = forestrl("render", *TINY, *words)
    assert result.status == 1 and expected in result.err and len(result.err.splitlines()) == 1
    assert not (tmp_path / "episode.gif").exists()


def test_what_breaks_off_leaves_whole_pictures_and_no_gif(tmp_path):
    env = forest(1)
    planner = NearestFrontier()

    def breaking(td):
        if td[K.STEP_COUNT].item() == 7:
            raise RuntimeError("no more")
        return planner(td)

    with pytest.raises(RuntimeError, match="no more"):
        draw_episode(
            {"breaking": Player(env, breaking)},
            tmp_path / "episode.gif",
            seed=0,
            arena=0,
            steps=20,
            every=2,
            frames=tmp_path / "frames",
        )
    assert [path.name for path in tmp_path.iterdir()] == ["frames"]
    names = sorted(path.name for path in (tmp_path / "frames").iterdir())
    assert names == ["0000.png", "0001.png", "0002.png", "0003.png"]
    for name in names:
        Image.open(tmp_path / "frames" / name).load()
