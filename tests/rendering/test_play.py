"""Episodes as scenes: what happened, in order, and how long they last."""

import pytest
import torch
from torchrl.envs import Compose, TransformedEnv

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import SafetyFilter
from forestrl.evaluation import arenas, uniforms
from forestrl.planners import CostBased, NearestFrontier
from forestrl.rendering import play
from forestrl.status import Status
from tests.drawing import world
from tests.envs.worlds import forest_env, given
from tests.evaluation.policies import always, forest, random_action, random_logits

LANE = """
    T . . . . . . . . . . A . T
    T T T T T T T T T T T T T T
    T T T T T T T T T T T T T T
"""
EAST, WEST = 5, 4


def lane(*transforms):
    """An env with one lane: east of the agent are a free cell and a trunk."""
    trees, position = world(LANE)
    bare = forest_env(size=tuple(trees.shape), n_trees=0)
    env = TransformedEnv(bare, Compose(*transforms)) if transforms else bare
    return env, given(env, trees, position)


def test_a_scene_is_given_of_every_few_steps_and_of_the_end():
    env = forest(1)
    td, draws = arenas.draw_arenas(env, 0, [0]), uniforms(0, [0], 9)
    for every, steps in ((1, [*range(10)]), (4, [0, 4, 8, 9]), (3, [0, 3, 6, 9]), (50, [0, 9])):
        scenes = play(env, random_action, td, steps=9, every=every, uniforms=draws)
        assert [scene.step for scene in scenes] == steps


def test_an_episode_ends_at_the_coverage_goal():
    env = forest(1, coverage_goal=0.8)
    *before, last = play(env, NearestFrontier(), arenas.draw_arenas(env, 0, [0]), steps=200)
    assert 1 < len(before) < 199 and all(scene.coverage < 0.8 for scene in before)
    assert last.coverage >= 0.8 == last.coverage_goal


def test_the_step_budget_of_the_env_does_not_end_it():
    env = forest(1, max_steps=3)
    td, draws = arenas.draw_arenas(env, 0, [0]), uniforms(0, [0], 8)
    scenes = list(play(env, random_action, td, steps=8, every=8, uniforms=draws))
    assert [scene.step for scene in scenes] == [0, 8]


def test_the_way_is_that_of_the_agent_and_the_curve_that_of_the_coverage():
    env = forest(1)
    td, draws = arenas.draw_arenas(env, 0, [2]), uniforms(0, [2], 12)
    scenes = list(play(env, random_action, td, steps=12, uniforms=draws))
    states = [env.reset(td, set_state=True)]
    for step in range(12):
        states.append(
            env.step_mdp(env.step(random_action(states[-1].set(K.UNIFORM, draws[:, step]))))
        )
    cells = [tuple(state[K.POSITION][0].tolist()) for state in states]
    for step, scene in enumerate(scenes):
        assert scene.way == tuple(cells[: step + 1]) and scene.agent == cells[step]
        assert scene.curve == tuple(float(s[K.COVERAGE]) for s in states[: step + 1])


def test_without_a_filter_running_into_a_trunk_is_a_collision():
    env, td = lane()
    scenes = list(play(env, always(EAST), td, steps=3))
    assert [scene.agent for scene in scenes] == [(0, 11), (0, 12), (0, 12), (0, 12)]
    assert [scene.collided for scene in scenes] == [False, True, True, False]
    assert [len(scene.collisions) for scene in scenes] == [0, 1, 2, 2]
    assert scenes[-1].collisions == ((0, 12), (0, 12)) and scenes[-1].interventions == ()
    assert not any(scene.has_filter or scene.intervened for scene in scenes)


def test_with_a_filter_it_is_an_intervention():
    env, td = lane(SafetyFilter())
    scenes = list(play(env, always(EAST), td, steps=3))
    assert [scene.agent for scene in scenes] == [(0, 11), (0, 12), (0, 11), (0, 12)]
    assert [scene.intervened for scene in scenes] == [False, True, False, False]
    assert [(scene.proposed, scene.executed) for scene in scenes[:2]] == [
        (EAST, EAST),
        (EAST, WEST),
    ]
    assert scenes[-1].interventions == ((0, 12),) and scenes[-1].collisions == ()
    assert all(scene.has_filter and not scene.collided for scene in scenes)


def test_a_scene_stays_as_it_is_while_the_episode_goes_on():
    env, td = lane()
    episode = play(env, always(EAST), td, steps=3)
    first = next(episode)
    list(episode)
    assert first.way == ((0, 11),) and first.collisions == () and len(first.curve) == 1


def test_the_last_scene_has_no_decision():
    *before, last = play(forest(1), random_logits, steps=2, uniforms=uniforms(0, [0], 2))
    assert last.proposed is None and last.executed is None and last.probability is None
    assert all(len(scene.probability) == 9 and scene.proposed is not None for scene in before)


@pytest.mark.parametrize("policy", [NearestFrontier(), CostBased(), random_action, always(2)])
@pytest.mark.parametrize("graph", [True, False])
@pytest.mark.parametrize("batch", [1, 3])
def test_any_policy_plays_in_any_env(policy, graph, batch):
    env = forest(batch, graph=graph)
    td = arenas.draw_arenas(env, 0, range(batch))
    scenes = list(play(env, policy, td, steps=3, uniforms=uniforms(0, range(batch), 3)))
    assert [scene.has_graph for scene in scenes] == [graph] * 4
    assert scenes[0].way == (tuple(td[K.POSITION][0].tolist()),)


def test_an_arena_can_be_played_again():
    env = forest(1)
    td = arenas.draw_arenas(env, 0, [0])
    entries = set(td.keys(True, True))
    first, again = (list(play(env, NearestFrontier(), td, steps=9)) for _ in range(2))
    assert [scene.curve for scene in first] == [scene.curve for scene in again]
    assert set(td.keys(True, True)) == entries


def test_an_episode_needs_no_batch_and_no_arena():
    assert len(list(play(forest(None), always(EAST), steps=4, every=2))) == 3


def test_a_planner_that_stays_says_why():
    env, td = lane()
    td[K.CELLS] = torch.full((3, 14), int(F.Cell.FREE), dtype=torch.uint8)
    td[K.CELLS][td[K.TREES]] = int(F.Cell.OCCUPIED)
    (scene, *_) = play(env, NearestFrontier(), td, steps=1)
    assert scene.status == Status.COVERED
