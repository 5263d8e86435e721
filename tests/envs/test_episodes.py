"""ForestEnv over many steps: purity, resets, seeds, and what holds in every rollout."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from tensordict import TensorDict
from torchrl.envs.utils import step_mdp

from forestrl import functional as F
from forestrl import keys as K
from tests.envs.worlds import assert_same_state, make_forest, make_transformed

MAKERS = [make_forest, make_transformed]
either_env = pytest.mark.parametrize("make", MAKERS, ids=["bare", "transformed"])


def rollout(env, steps, seed=0):
    """Random actions, over the ends of episodes."""
    torch.manual_seed(seed)
    return env.rollout(steps, break_when_any_done=False)


@either_env
@pytest.mark.parametrize("num_envs", [None, 3])
def test_a_step_is_a_pure_function_of_its_input(make, num_envs):
    env = make(num_envs=num_envs)
    td = env.rand_action(env.reset())
    before = td.clone()
    first = env.step(td.clone())
    rollout(env, 7)
    second = env.step(td.clone())
    assert_same_state(first, second)
    assert_same_state(td, before)


@either_env
def test_a_later_step_does_not_change_an_earlier_state(make):
    env = make(num_envs=3)
    td = env.rand_action(env.reset())
    after = env.step(td)
    kept = after.clone()
    env.step(env.rand_action(step_mdp(after)))
    env.reset()
    assert_same_state(after, kept)


@either_env
def test_a_partial_reset_leaves_the_other_arenas_alone(make):
    env = make(num_envs=3)
    td = env.reset()
    for _ in range(3):
        td = step_mdp(env.step(env.rand_action(td)))
    before = td.clone()
    td["_reset"] = torch.tensor([[True], [False], [False]])
    td = env.reset(td, set_state=False)
    assert td["step_count"].flatten().tolist() == [0, 3, 3]
    assert not torch.equal(td[K.TREES][0], before[K.TREES][0])
    kept = [key for key in before.keys(True, True) if key in td.keys(True, True)]
    assert set(kept) >= {K.TREES, K.TRAVERSABLE, K.CELLS, K.POSITION, K.COVERAGE, "step_count"}
    for key in kept:
        if key != "action":
            assert torch.equal(td[key][1:], before[key][1:]), key
    first = F.scan(td[K.TREES][0], td[K.POSITION][0], F.sight_lines(5.0))
    assert torch.equal(td[K.CELLS][0] != F.Cell.UNKNOWN, first)


@either_env
def test_every_episode_has_new_trunks_and_a_new_map(make):
    env = make(num_envs=2, max_steps=4, coverage_goal=1.0)
    steps = rollout(env, 12)
    assert steps["next", "truncated"].sum() >= 6
    starts = steps["step_count"].squeeze(-1) == 0
    for arena in range(2):
        ends = steps["next", "done"][arena, :-1, 0]
        assert torch.equal(starts[arena, 1:], ends)  # a step after an end starts an episode
        forests = steps[K.TREES][arena][starts[arena]].flatten(1).tolist()
        assert len({tuple(forest) for forest in forests}) == len(forests) >= 3
    known = (steps[K.CELLS] != F.Cell.UNKNOWN)[starts].flatten(1).sum(-1, keepdim=True)
    assert torch.equal(steps[K.NEW_CELLS][starts], known.float())


@either_env
@pytest.mark.parametrize("num_envs", [None, 3])
def test_a_seed_gives_the_same_episodes_again(make, num_envs):
    env = make(num_envs=num_envs, max_steps=5)
    env.set_seed(11)
    first = rollout(env, 12)
    env.set_seed(11)
    assert_same_state(first, rollout(env, 12))
    env.set_seed(12)
    assert not torch.equal(first[K.TREES], rollout(env, 12)[K.TREES])


@either_env
def test_the_seed_of_the_constructor_is_that_of_the_first_episodes(make):
    first, second = make(seed=3, num_envs=3).reset(), make(seed=3, num_envs=3).reset()
    assert_same_state(first, second)
    assert not torch.equal(first[K.TREES], make(seed=4, num_envs=3).reset()[K.TREES])


def test_the_world_does_not_draw_from_the_global_generator():
    env = make_forest(num_envs=3)
    before = torch.get_rng_state()
    td = env.reset()
    env.step(td.set("action", torch.tensor([1, 2, 3])))
    assert torch.equal(torch.get_rng_state(), before)


@either_env
def test_arenas_do_not_influence_each_other(make):
    """Three arenas stepped at once are the three stepped alone."""
    many, one = make(num_envs=3), make(num_envs=None)
    td = many.reset()
    worlds = [TensorDict({K.TREES: t[K.TREES], K.POSITION: t[K.POSITION]}) for t in td.unbind(0)]
    alone = [one.reset(world, set_state=True) for world in worlds]
    torch.manual_seed(0)
    for _ in range(6):
        actions = torch.randint(9, (3,))
        td = step_mdp(many.step(td.set("action", actions)))
        alone = [
            step_mdp(one.step(state.set("action", action)))
            for state, action in zip(alone, actions, strict=True)
        ]
        assert_same_state(td.exclude("action"), torch.stack(alone).exclude("action"))


@given(seed=st.integers(0, 1000), filtered=st.booleans())
@settings(max_examples=10)
def test_every_rollout_keeps_the_laws_of_the_world(seed, filtered):
    make = make_transformed if filtered else make_forest
    env = make(num_envs=4, seed=seed, lidar_range=2.5, coverage_goal=1.0, max_steps=1000)
    steps = rollout(env, 25, seed)
    assert not steps["next", "done"].any()  # one episode each
    state = steps["next"]
    cells, trees, position = state[K.CELLS], state[K.TREES], state[K.POSITION]

    known = cells != F.Cell.UNKNOWN
    assert torch.equal(cells[known] == F.Cell.OCCUPIED, trees[known])  # the map agrees with truth
    was_known = steps[K.CELLS] != F.Cell.UNKNOWN
    assert (known | ~was_known).all()  # nothing is forgotten

    assert not F.gather(trees, position.unsqueeze(-2), True).any()  # never on a trunk
    assert (state[K.COVERAGE] >= steps[K.COVERAGE]).all()
    assert ((state[K.COVERAGE] > 0) & (state[K.COVERAGE] <= 1)).all()

    gained = steps[K.NEW_CELLS][:, 0] + state[K.NEW_CELLS].sum(1)
    assert torch.equal(gained, known[:, -1].flatten(1).sum(-1, keepdim=True).float())
    displacement = position - steps[K.POSITION]
    assert displacement.abs().max() <= 1
    assert torch.equal(state["step_count"], steps["step_count"] + 1)
    assert (trees == trees[:, :1]).all() and (state[K.TRAVERSABLE] == steps[K.TRAVERSABLE]).all()
    collided = state[K.COLLISION].squeeze(-1)
    assert not displacement[collided].any()
    if filtered:
        assert not collided.any()
    else:
        assert torch.equal(state["reward"], state[K.NEW_CELLS])
        moves = F.DISPLACEMENTS[steps["action"]]
        assert torch.equal(displacement[~collided], moves[~collided])
