"""ForestEnv: the world, without any transform."""

from __future__ import annotations

import inspect

import pytest
import torch
from hypothesis import given as hypothesis_given
from hypothesis import strategies as st
from torchrl.envs.utils import check_env_specs

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import ForestEnv
from tests.drawing import draw, world
from tests.envs.worlds import (
    CORRIDOR,
    SIZE,
    assert_same_state,
    env_for,
    given,
    make_forest,
    step,
)

BATCHES = [(None, ()), (1, (1,)), (3, (3,))]
KEYS = {  # key: shape after the batch, dtype
    ("arena", "trees"): ((SIZE, SIZE), torch.bool),
    ("arena", "traversable"): ((SIZE, SIZE), torch.bool),
    ("map", "cells"): ((SIZE, SIZE), torch.uint8),
    ("agent", "position"): ((2,), torch.int64),
    ("exploration", "new_cells"): ((1,), torch.float32),
    ("exploration", "coverage"): ((1,), torch.float32),
    ("safety", "collision"): ((1,), torch.bool),
    "step_count": ((1,), torch.int64),
}
FLAGS = dict.fromkeys(["done", "terminated", "truncated"], ((1,), torch.bool))


def test_table_3_gives_the_defaults():
    parameters = inspect.signature(ForestEnv.__init__).parameters
    expected = {
        "lidar_range": 5.0,
        "coverage_goal": 0.98,
        "max_steps": 2500,
        "num_envs": None,
    }
    assert {name: parameters[name].default for name in expected} == expected
    world = ForestEnv().world
    assert (world.shape, world.n_trees, world.tree_radius) == ((50, 50), 45, (1.0, 3.0))


@pytest.mark.parametrize(("num_envs", "batch"), BATCHES)
def test_the_env_fulfils_its_specs(num_envs, batch):
    env = make_forest(num_envs=num_envs)
    assert env.batch_size == batch
    check_env_specs(env, seed=0)


@pytest.mark.parametrize(("num_envs", "batch"), BATCHES)
def test_the_env_writes_the_keys_of_the_schema(num_envs, batch):
    env = make_forest(num_envs=num_envs)
    spec = env.observation_spec
    assert set(spec.keys(True, True)) == set(KEYS)
    rollout = env.rollout(2, break_when_any_done=False)
    step_keys = KEYS | FLAGS | {"reward": ((1,), torch.float32)}
    for key, (shape, dtype) in KEYS.items():
        assert (spec[key].shape, spec[key].dtype) == ((*batch, *shape), dtype), key
    for state, keys in ((rollout, KEYS | FLAGS), (rollout["next"], step_keys)):
        for key, (shape, dtype) in keys.items():
            assert (state[key].shape, state[key].dtype) == ((*batch, 2, *shape), dtype), key
    action = rollout["action"]
    assert (action.shape, action.dtype) == ((*batch, 2), torch.int64)
    assert env.action_spec.n == 9


def test_the_constants_of_the_schema_are_its_keys():
    names = ["TREES", "TRAVERSABLE", "CELLS", "POSITION", "NEW_CELLS", "COVERAGE", "COLLISION"]
    assert {getattr(K, name) for name in names} == set(KEYS) - {"step_count"}


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("lidar_range", 0.0),
        ("coverage_goal", 1.5),
        ("coverage_goal", 0.0),
        ("max_steps", 0),
        ("num_envs", 0),
    ],
)
def test_an_option_out_of_its_range_is_refused_by_name(option, value):
    with pytest.raises(ValueError, match=option):
        make_forest(**{option: value})


def test_a_reset_starts_an_episode():
    env = make_forest(num_envs=20, n_trees=20)
    td = env.reset()
    assert (td["step_count"] == 0).all()
    for key in ("done", "terminated", "truncated", K.COLLISION):
        assert not td[key].any()
    trees, position = td[K.TREES], td[K.POSITION]
    assert not F.gather(trees, position.unsqueeze(-2), True).any()
    assert torch.equal(td[K.TRAVERSABLE], F.largest_component(~trees))
    assert F.gather(td[K.TRAVERSABLE], position.unsqueeze(-2), False).all()
    seen = F.scan(trees, position, F.sight_lines(5.0))
    assert torch.equal(td[K.CELLS] != F.Cell.UNKNOWN, seen)
    assert torch.equal(td[K.NEW_CELLS], seen.flatten(1).sum(-1, keepdim=True).float())
    assert torch.equal(td[K.COVERAGE], F.coverage(td[K.CELLS], td[K.TRAVERSABLE]))


def test_a_reset_draws_a_forest_for_each_arena_and_each_episode():
    env = make_forest(num_envs=4, tree_radius=(1.0, 2.0))
    first, second = env.reset()[K.TREES], env.reset()[K.TREES]
    arenas = torch.cat([first, second]).flatten(1).tolist()
    assert len({tuple(arena) for arena in arenas}) == 8


def test_a_reset_takes_a_given_world():
    _, td = env_for(CORRIDOR, lidar_range=2.0)
    trees, position = world(CORRIDOR)
    assert torch.equal(td[K.TREES], trees) and torch.equal(td[K.POSITION], position)
    assert draw(td[K.CELLS], td[K.POSITION]) == "A . . ?\nT T ? ?\n? ? ? ?\n? ? ? ?"
    assert td[K.NEW_CELLS].item() == 5
    assert td[K.COVERAGE].item() == pytest.approx(3 / 4)


def test_a_reset_takes_a_given_world_for_each_arena():
    env = make_forest(num_envs=2, size=4, n_trees=0)
    trees = torch.stack([world(CORRIDOR)[0], world(CORRIDOR)[0].T])
    position = torch.tensor([[0, 3], [3, 0]])
    td = env.reset(given(env, trees, position), set_state=True)
    assert torch.equal(td[K.TREES], trees) and torch.equal(td[K.POSITION], position)


def test_a_reset_draws_the_start_in_a_given_world_from_its_largest_component():
    trees, _ = world("""
        A T . .
        T T . .
        . . . T
        . T T .
    """)
    env = make_forest(num_envs=60, size=4, n_trees=0)
    td = env.reset(given(env, trees.expand(60, 4, 4)), set_state=True)
    starts = {tuple(position) for position in td[K.POSITION].tolist()}
    assert starts <= {(0, 2), (0, 3), (1, 2), (1, 3), (2, 0), (2, 1), (2, 2), (3, 0), (3, 3)}
    assert len(starts) > 4


def test_coverage_counts_the_component_of_a_given_start():
    _, td = env_for("""
        A . T .
        . . T .
        T T T .
        . . . .
    """)
    assert td[K.TRAVERSABLE].sum() == 4
    assert td[K.COVERAGE].item() == 1.0


def test_a_reset_into_an_explored_world_is_not_done():
    """The episode ends with the first step, as TorchRL asks for."""
    env, td = env_for("T T T\nT A T\nT T T")
    assert td[K.COVERAGE].item() == 1.0 and not td["done"]
    after = step(env, td, 0)
    assert after["terminated"] and after["done"] and not after["truncated"]


def test_a_step_moves_scans_and_rewards_new_cells():
    env, td = env_for(CORRIDOR, lidar_range=1.5)
    assert draw(td[K.CELLS]) == ". . ? ?\nT T ? ?\n? ? ? ?\n? ? ? ?"
    after = step(env, td, 5)
    assert after[K.POSITION].tolist() == [0, 1]
    assert draw(after[K.CELLS]) == ". . . ?\nT T T ?\n? ? ? ?\n? ? ? ?"
    assert after[K.NEW_CELLS].tolist() == after["reward"].tolist() == [2.0]
    assert after[K.COVERAGE].item() == pytest.approx(3 / 4)
    assert after["step_count"].tolist() == [1]


@pytest.mark.parametrize("action", [1, 2, 3, 4, 6, 7, 8])
def test_an_infeasible_action_leaves_the_agent_and_raises_collision(action):
    env, td = env_for(CORRIDOR)
    after = step(env, td, action)
    assert after[K.POSITION].tolist() == [0, 0]
    assert after[K.COLLISION].tolist() == [True]
    assert after["step_count"].tolist() == [1]


@pytest.mark.parametrize("action", [0, 5])
def test_a_feasible_action_does_not_collide(action):
    env, td = env_for(CORRIDOR)
    assert step(env, td, action)[K.COLLISION].tolist() == [False]


@pytest.mark.parametrize(
    ("coverage_goal", "max_steps", "terminated", "truncated"),
    [
        (0.8, 2, False, False),
        (0.75, 2, True, False),  # 3 of 4 cells: rho >= rho* ends, equality included
        (0.8, 1, False, True),
        (0.75, 1, True, True),
    ],
)
def test_termination_and_truncation_truth_table(coverage_goal, max_steps, terminated, truncated):
    env, td = env_for(CORRIDOR, lidar_range=1.5, coverage_goal=coverage_goal, max_steps=max_steps)
    after = step(env, td, 5)
    assert after[K.COVERAGE].item() == pytest.approx(0.75)
    assert after["terminated"].tolist() == [terminated]
    assert after["truncated"].tolist() == [truncated]
    assert after["done"].tolist() == [terminated or truncated]


@pytest.mark.parametrize("known", range(3, 11))
def test_termination_at_exactly_the_goal(known):
    """Ten free cells: ``known / 10`` as the goal is met by ``known`` cells, not by one less."""
    rows = ["A " + ". " * 9, *["T " * 10] * 9]
    env, td = env_for("\n".join(rows), lidar_range=1.5, coverage_goal=known / 10)
    done, cells = False, 2
    while not done:
        after = step(env, td, 5)
        cells, done = cells + 1, bool(after["terminated"])
        td = after.exclude("reward")
        assert cells <= 10
    assert cells == known


@hypothesis_given(st.integers(0, 10_000))
def test_coverage_is_met_exactly_by_the_share_known(seed):
    """Whatever the number of traversable cells, a goal of n / N is met by n cells."""
    td = make_forest(seed=seed).reset()
    known = ((td[K.CELLS] == F.Cell.FREE) & td[K.TRAVERSABLE]).sum().item()
    assert td[K.COVERAGE] >= known / td[K.TRAVERSABLE].sum().item()
    assert not td[K.COVERAGE] >= (known + 1) / td[K.TRAVERSABLE].sum().item()


def test_given_worlds_do_not_share_memory_with_the_state():
    trees, position = world(CORRIDOR)
    env = make_forest(size=4, n_trees=0)
    td = env.reset(given(env, trees, position), set_state=True)
    before = td.clone()
    env.rollout(5, auto_reset=False, tensordict=td.clone(), break_when_any_done=False)
    assert_same_state(td, before)
    assert torch.equal(trees, world(CORRIDOR)[0])
