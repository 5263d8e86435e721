"""The three contributions at work: Algorithm 1, the observation and Equation 6 in the env."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torchrl.envs import Compose, TransformedEnv
from torchrl.envs.utils import step_mdp

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import ExplorationGraph, FrontierPotentialReward, SafetyFilter
from tests import oracles
from tests.envs.worlds import (
    CORRIDOR,
    assert_same_state,
    env_for,
    leaves,
    make_forest,
    make_transformed,
    paper_transforms,
    step,
)
from tests.envs.worlds import given as given_world

BELIEF = [K.FEASIBLE, K.NODES, K.WAYPOINT, K.LENGTH, K.FRONTIERS, K.POTENTIAL, K.CELLS, K.POSITION]


def rollout(env, steps, seed=0):
    torch.manual_seed(seed)
    return env.rollout(steps, break_when_any_done=False)


def test_algorithm_1_keeps_the_proposed_action_at_the_root():
    steps = rollout(make_transformed(num_envs=8, n_trees=16, max_steps=7), 40)
    state = steps["next"]
    changed = steps["action"] != state[K.EXECUTED]
    assert torch.equal(changed.unsqueeze(-1), state[K.INTERVENED])
    assert changed.any() and not changed.all()
    assert steps["action"].unique().tolist() == list(range(9))  # what random actions propose


def test_algorithm_1_executes_what_the_map_allows():
    steps = rollout(make_transformed(num_envs=4, n_trees=16, max_steps=7), 20)
    feasible, executed = steps[K.FEASIBLE], steps["next", K.EXECUTED]
    assert feasible.gather(-1, executed.unsqueeze(-1)).all()
    assert torch.equal(executed, F.safe_action(steps["action"], feasible))
    rows = feasible.flatten(0, -2).tolist()
    for row, action, done in zip(rows, steps["action"].flatten(), executed.flatten(), strict=True):
        assert done == oracles.safe_action(int(action), row)


def test_algorithm_1_moves_the_agent_by_the_executed_action():
    steps = rollout(make_transformed(num_envs=4, n_trees=16), 20)
    moved = steps["next", K.POSITION] - steps[K.POSITION]
    assert torch.equal(moved, F.DISPLACEMENTS[steps["next", K.EXECUTED]])


def test_algorithm_1_lets_no_collision_happen():
    state = rollout(make_transformed(num_envs=8, n_trees=25, max_steps=9), 60)["next"]
    assert not state[K.COLLISION].any()
    assert not F.gather(state[K.TREES], state[K.POSITION].unsqueeze(-2), True).any()


def test_algorithm_1_in_a_drawn_world():
    env, td = env_for(CORRIDOR, SafetyFilter())
    assert td[K.FEASIBLE].tolist() == [True] + [False] * 4 + [True] + [False] * 3
    after = step(env, td, 8)  # into a trunk: the only feasible way is a5
    assert after[K.EXECUTED] == 5 and after[K.INTERVENED].tolist() == [True]
    assert after[K.POSITION].tolist() == [0, 1]
    assert after[K.FEASIBLE].tolist() == [i in (0, 4, 5) for i in range(9)]


def test_algorithm_1_reads_the_agents_map_and_not_the_hidden_truth():
    env, td = env_for(CORRIDOR, SafetyFilter())
    td[K.CELLS][0, 1] = int(F.Cell.UNKNOWN)  # free in truth, but the agent does not know
    after = step(env, td, 5)
    assert after[K.EXECUTED] == 0 and after[K.INTERVENED].tolist() == [True]
    assert after[K.POSITION].tolist() == [0, 0]


def test_algorithm_1_waits_when_boxed_in():
    env, td = env_for("T T T\nT A T\nT T T", SafetyFilter())
    after = step(env, td, 3)
    assert after[K.EXECUTED] == 0 and after[K.INTERVENED].tolist() == [True]
    assert after[K.POSITION].tolist() == [1, 1] and not after[K.COLLISION]


def test_a_reset_reports_no_intervention():
    env = make_transformed(num_envs=3)
    td = env.reset()
    for _ in range(3):
        td = step_mdp(env.step(env.rand_action(td)))
    td["_reset"] = torch.tensor([[True], [False], [True]])
    td = env.reset(td, set_state=False)
    assert td[K.EXECUTED][[0, 2]].tolist() == [0, 0]
    assert not td[K.INTERVENED][[0, 2]].any()


def test_the_graph_reads_its_options():
    options = {"window": 3, "max_frontiers": 4, "lidar_range": 2.5}
    graph = ExplorationGraph(**options)
    env = TransformedEnv(make_forest(num_envs=2, lidar_range=2.5), Compose(graph))
    td = env.reset()
    expected = F.exploration_graph(td[K.CELLS], td[K.POSITION], **options)
    assert (td[K.FRONTIERS] > 4).all()  # it overflows, and says so
    found = (td[K.NODES], td[K.WAYPOINT], td[K.LENGTH], td[K.FRONTIERS])
    for ours, theirs in zip(found, expected, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=0, atol=1e-6)


@given(st.integers(0, 1000))
@settings(max_examples=10)
def test_the_first_observation_does_not_depend_on_trees_out_of_sight(seed):
    options = {"size": 16, "lidar_range": 2.5, "n_trees": 12, "num_envs": 2}
    env = TransformedEnv(make_forest(seed=seed, **options), Compose(*paper_transforms()))
    td = env.reset()
    near = F.scan(torch.zeros_like(td[K.TREES]), td[K.POSITION], F.sight_lines(2.5))
    noise = torch.rand(near.shape, generator=torch.Generator().manual_seed(seed)) < 0.3
    others = torch.where(near, td[K.TREES], noise)
    assert not torch.equal(others, td[K.TREES])
    again = env.reset(given_world(env, others, td[K.POSITION]), set_state=True)
    for key in BELIEF:
        assert torch.equal(td[key], again[key]), key


@given(st.integers(0, 1000))
@settings(max_examples=10)
def test_a_later_observation_and_reward_do_not_depend_on_unseen_trees(seed):
    options = {"size": 16, "lidar_range": 2.5, "n_trees": 12, "num_envs": 2}
    env = TransformedEnv(make_forest(seed=seed, **options), Compose(*paper_transforms()))
    td = env.reset()
    torch.manual_seed(seed)
    for _ in range(8):
        td = step_mdp(env.step(env.rand_action(td)))
    near = F.scan(torch.zeros_like(td[K.TREES]), td[K.POSITION], F.sight_lines(2.5 + 1.5))
    fixed = near | (td[K.CELLS] != F.Cell.UNKNOWN)  # known, or within range after one more step
    noise = torch.rand(near.shape, generator=torch.Generator().manual_seed(seed)) < 0.3
    other = td.clone()
    other[K.TREES] = torch.where(fixed, td[K.TREES], noise)
    assert not torch.equal(other[K.TREES], td[K.TREES])
    for action in range(9):
        ours, theirs = step(env, td, action), step(env, other, action)
        for key in [*BELIEF, K.EXECUTED, K.INTERVENED, K.NEW_CELLS, "reward"]:
            assert torch.equal(ours[key], theirs[key]), key


@pytest.mark.parametrize("num_envs", [None, 4])
def test_equation_6_holds_in_every_step(num_envs):
    """Also after auto-resets, where the potential of the new episode counts."""
    env = make_transformed(num_envs=num_envs, n_trees=12, max_steps=30, lidar_range=4.0)
    steps = rollout(env, 120).reshape(-1)
    state = steps["next"]
    assert (steps["step_count"] == 0).sum() > 1
    before, after = steps[K.POTENTIAL].flatten().tolist(), state[K.POTENTIAL].flatten().tolist()
    explored = (state[K.COVERAGE] >= 0.98).flatten().tolist()
    unsafe = state[K.INTERVENED].flatten().tolist()
    new_cells = state[K.NEW_CELLS].flatten().tolist()
    expected = [
        oracles.reward(n, phi, next_phi, explored=e, unsafe=u)
        for n, phi, next_phi, e, u in zip(new_cells, before, after, explored, unsafe, strict=True)
    ]
    assert state["reward"].flatten().tolist() == pytest.approx(expected, abs=1e-5)
    assert any(unsafe) and not all(unsafe)


@pytest.mark.parametrize(
    ("action", "goal", "reward"),
    [
        (5, 0.75, 100.0),  # 3 of 4 cells known after a step to the right
        (8, 0.75, -5.0),  # the filter replaces a8 by a5: completed, but not the policy's doing
        (8, 0.80, -5.0),
    ],
)
def test_equation_6_in_a_drawn_world(action, goal, reward):
    chain = [SafetyFilter(), FrontierPotentialReward(coverage_goal=goal)]
    env, td = env_for(CORRIDOR, *chain, lidar_range=1.5, coverage_goal=goal)
    after = step(env, td, action)
    assert after["reward"].tolist() == [reward]
    assert after["terminated"].tolist() == [goal == 0.75]


def test_equation_6_adds_the_change_of_the_potential_by_hand():
    chain = [SafetyFilter(), FrontierPotentialReward(window=3, beta=0.5)]
    env, td = env_for(CORRIDOR, *chain, lidar_range=1.5)
    # The map is ". . ? ? / T T ? ?": the frontier is (0, 1), at 1 of sqrt(2) 3, 2 of 9 unknown.
    scale = 2**0.5 * 3
    before = (-1 / scale + 0.5 * 2 / 9 + 1) / 1.5
    assert td[K.POTENTIAL].item() == pytest.approx(before, abs=1e-6)
    # A step right sees (0, 2) and (1, 2); the frontier is (0, 2), at 1, again 2 of 9 unknown.
    after = step(env, td, 5)
    assert after[K.POTENTIAL].item() == pytest.approx(before, abs=1e-6)
    assert after["reward"].item() == pytest.approx(2.0, abs=1e-6)
    # Waiting there changes nothing.
    wait = step(env, after.exclude("reward"), 0)
    assert wait["reward"].item() == pytest.approx(0.0, abs=1e-6)
    # Going back sees nothing and is 1 further from the frontier.
    back = step(env, after.exclude("reward"), 4)
    assert back["reward"].item() == pytest.approx(-1 / scale / 1.5, abs=1e-6)


def test_the_rewards_of_equation_6_are_options():
    chain = [SafetyFilter(), FrontierPotentialReward(coverage_goal=0.75, r_explored=7, r_unsafe=-1)]
    env, td = env_for(CORRIDOR, *chain, lidar_range=1.5)
    assert step(env, td, 5)["reward"].item() == 7.0
    assert step(env, td, 8)["reward"].item() == -1.0


def test_without_the_filter_a_collision_is_unsafe():
    env, td = env_for(CORRIDOR, FrontierPotentialReward())
    after = step(env, td, 8)
    assert after[K.COLLISION] and after["reward"].item() == -5.0
    assert after[K.POSITION].tolist() == [0, 0]


def test_a_written_down_state_can_be_stepped_from():
    """Only the world's own keys are needed; what the transforms add is derived."""
    env, td = env_for(CORRIDOR, *paper_transforms(), lidar_range=1.5)
    bare = td.select(K.TREES, K.TRAVERSABLE, K.CELLS, K.POSITION, "step_count")
    ours, theirs = step(env, td, 5), step(env, bare, 5)
    assert_same_state(ours, theirs)
    assert len(leaves(theirs)) == len(leaves(ours))


def test_equation_6_without_shaping_leaves_the_new_cells():
    plain, td = env_for(CORRIDOR, FrontierPotentialReward(shaping=False))
    shaped, _ = env_for(CORRIDOR, FrontierPotentialReward())
    for action in range(1, 9):
        bare, whole = step(plain, td, action), step(shaped, td, action)
        assert torch.equal(bare[K.POTENTIAL], whole[K.POTENTIAL])
        if not bare[K.COLLISION] and not bare["terminated"]:
            assert torch.equal(bare["reward"], bare[K.NEW_CELLS])
