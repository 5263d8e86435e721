"""The exploration as users of Gymnasium meet it."""

import copy
import pickle
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv
from gymnasium.wrappers import RecordEpisodeStatistics
from torchrl.envs import GymEnv, check_env_specs

import forestrl.gymnasium
from forestrl import functional as F
from forestrl.envs import RandomForest
from tests.drawing import world

SMALL = {
    "world": RandomForest((9, 12), n_trees=8, tree_radius=(0.5, 1.0)),
    "graph": {"max_frontiers": 24},
    "max_steps": 40,
}


def make(**options):
    return gymnasium.make(forestrl.gymnasium.ID, **SMALL | options)


def episodes(env, seed, steps=60):
    """What a walker that draws feasible actions meets, over the ends of episodes."""
    observation, info = env.reset(seed=seed)
    env.action_space.seed(0)
    seen = [observation]
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(
            env.action_space.sample(info["action_mask"])
        )
        seen += [observation, reward, info["coverage"]]
        if terminated or truncated:
            observation, info = env.reset()
            seen.append(observation)
    return seen


def drawn(drawing):
    trees, position = world(drawing)
    return {"trees": trees.numpy(), "position": position.numpy()}


def make_drawn(drawing, **options):
    rows = drawn(drawing)["trees"].shape
    return make(world=RandomForest(rows, n_trees=0), **options)


def test_gymnasiums_checker_has_nothing_to_say():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(render_mode="rgb_array").unwrapped)


def test_the_module_may_be_named_in_the_id():
    code = """
import sys, gymnasium
env = gymnasium.make("forestrl.gymnasium:ForestRL/Exploration-v0")
print(env.spec.id)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "ForestRL/Exploration-v0\n", done.stderr


def test_the_registration_imports_no_torch():
    code = "import sys, forestrl.gymnasium; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "False\n", done.stderr


def test_a_seed_repeats_a_sequence_of_episodes_and_another_seed_does_not():
    first, again, other = (episodes(make(), seed) for seed in (3, 3, 4))
    assert data_equivalence(first, again, exact=True) and not data_equivalence(first[0], other[0])


def test_episodes_after_the_first_are_in_other_forests():
    env = make()
    first, _ = env.reset(seed=3)
    second, _ = env.reset()
    assert not np.array_equal(first["nodes"], second["nodes"])


def test_envs_without_a_seed_differ():
    starts = {make().reset()[0]["nodes"].tobytes() for _ in range(4)}
    assert len(starts) > 1


def test_the_observation_is_the_padded_graph_of_the_map():
    env = make()
    for observation in (episodes(env, 0)[0], env.reset(seed=5)[0]):
        nodes = observation["nodes"].reshape(-1, 8)
        there = nodes.any(-1)
        assert there[:9].all() and np.array_equal(there[9:], observation["waypoint"] > 0)
        assert not observation["length"][~there[9:]].any()
    state = env.unwrapped._state
    graph = F.exploration_graph(
        state["map", "cells"], state["agent", "position"],
        window=7, max_frontiers=24, lidar_range=5.0,
    )  # fmt: skip
    np.testing.assert_allclose(observation["nodes"].reshape(-1, 8), graph.x, atol=1e-6)
    assert np.array_equal(observation["waypoint"], graph.waypoint)
    np.testing.assert_allclose(observation["length"], graph.length, atol=1e-6)


def test_the_mask_tells_the_feasible_actions():
    env = make_drawn("A . T\n. T .\n. . .")
    _, info = env.reset(options=drawn("A . T\n. T .\n. . ."))
    assert info["action_mask"].tolist() == [1, 0, 0, 0, 0, 1, 0, 1, 0]
    assert info["action_mask"].dtype == np.int8 and env.unwrapped.action_masks().dtype == bool
    assert env.unwrapped.action_masks().tolist() == info["action_mask"].astype(bool).tolist()


@pytest.mark.parametrize(("safety", "event"), [(True, "intervened"), (False, "collision")])
def test_an_infeasible_action_is_replaced_or_collides(safety, event):
    drawing = "A T .\n. . .\n. . ."
    env = make_drawn(drawing, safety=safety)
    env.reset(options=drawn(drawing))
    _, reward, *_, info = env.step(5)  # east, into the trunk
    assert [name for name in ("intervened", "collision") if info[name]] == [event]
    assert reward == -5.0 and info["position"].tolist() == ([1, 0] if safety else [0, 0])


def test_an_episode_ends_by_time_and_by_the_goal():
    env = make(max_steps=3, coverage_goal=1.0, world=RandomForest(30, n_trees=0))
    env.reset(seed=0)
    ends = [env.step(0)[2:4] for _ in range(3)]
    assert ends == [(False, False), (False, False), (False, True)]
    env = make_drawn("A . .\n. . .\n. . .", lidar_range=1.5)
    env.reset(options=drawn("A . .\n. . .\n. . ."))
    _, reward, terminated, truncated, info = env.step(8)
    assert (reward, terminated, truncated, info["coverage"]) == (100.0, True, False, 1.0)


def test_what_a_user_changes_in_place_does_not_reach_the_env():
    env = make()
    observation, info = env.reset(seed=0)
    before = info["position"].copy()
    info["position"] += 3
    observation["nodes"][:] = 7
    assert np.array_equal(env.step(0)[-1]["position"], before)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tree": 1}, r"\['tree'\] are not allowed"),
        ({"trees": np.zeros((3, 3), bool)}, "this env takes"),
        ({"trees": np.zeros((9, 12), bool), "position": (9, 0)}, "a free cell inside"),
        ({"position": (0, 0)}, "needs"),
    ],
)
def test_options_of_a_reset_that_do_not_fit_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        make().reset(options=options)


@pytest.mark.parametrize("name", ["num_envs", "seed", "device", "tree_count"])
def test_settings_that_one_env_has_no_use_for_are_refused(name):
    with pytest.raises(TypeError, match=name):
        make(**{name: 1})


def test_a_step_needs_a_reset_and_an_action_of_the_table():
    env = make().unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(0)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="action=9 is not allowed"):
        env.step(9)


def test_a_picture_shows_the_episode():
    env = make(render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    env.step(1)
    assert first.dtype == np.uint8 and first.shape[-1] == 3
    assert env.render().shape == first.shape and not np.array_equal(env.render(), first)
    assert make().unwrapped.render() is None


@pytest.mark.parametrize("twin", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_like_the_original(twin):
    env = make().unwrapped
    episodes(env, 0, steps=5)
    other = twin(env)
    assert data_equivalence(env.step(0)[0], other.step(0)[0], exact=True)
    assert data_equivalence(env.reset(), other.reset(), exact=True)


@pytest.mark.parametrize(
    "start",
    [None, *(pytest.param(start, marks=pytest.mark.slow) for start in ("fork", "spawn"))],
)
def test_vectors_of_envs_do_as_each_env_alone(start):
    """In one process, and in several that were forked or spawned."""
    makers = [lambda: RecordEpisodeStatistics(make(max_steps=5))] * 2
    envs = SyncVectorEnv(makers) if start is None else AsyncVectorEnv(makers, context=start)
    alone = [make(max_steps=5) for _ in makers]
    observation, info = envs.reset(seed=8)
    for row, env in enumerate(alone):
        expected, _ = env.reset(seed=8 + row)
        assert np.array_equal(observation["nodes"][row], expected["nodes"])
    assert info["action_mask"].shape == (2, 9)
    for _ in range(4):
        observation, reward, *_ = envs.step(np.array([1, 8]))
    for row, (env, action) in enumerate(zip(alone, (1, 8), strict=True)):
        steps = [env.step(action) for _ in range(4)]
        assert np.array_equal(observation["length"][row], steps[-1][0]["length"])
        assert reward[row] == pytest.approx(steps[-1][1])
    *_, truncated, info = envs.step(np.array([0, 0]))
    assert truncated.all() and info["episode"]["l"].tolist() == [5, 5]
    assert not envs.step(np.array([0, 0]))[3].any()  # begins the next episodes
    envs.close()


def test_make_vec_takes_the_name():
    envs = gymnasium.make_vec(forestrl.gymnasium.ID, 2, vectorization_mode="sync", **SMALL)
    observation, _ = envs.reset(seed=0)
    assert observation["waypoint"].shape == (2, 24)
    envs.close()


def test_torchrl_reads_it_back():
    env = GymEnv(forestrl.gymnasium.ID, categorical_action_encoding=True, **SMALL)
    check_env_specs(env, seed=0)
    other = make()
    other.reset(seed=7)
    nodes, _ = other.reset()  # TorchRL's set_seed resets once
    env.set_seed(7)
    assert np.array_equal(env.reset()["nodes"], nodes["nodes"])
