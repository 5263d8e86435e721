"""The planner that knows the arena beforehand."""

import pytest
import torch

from forestrl import functional as F
from forestrl import keys as K
from forestrl.planners import Hindsight, NearestFrontier
from forestrl.planners.hindsight import annealing
from forestrl.status import Status
from tests.drawing import world
from tests.envs.worlds import env_for, forest_env, given, make_forest

LINES = F.sight_lines(3.0)
TWO_ENDS = """
    . . A . . . . .
    T T T T T T T T
    T T T T T T T T
    T T T T T T T T
    T T T T T T T T
    T T T T T T T T
    T T T T T T T T
    T T T T T T T T
"""
BOXED_IN = """
    T T T
    T A T
    T T T
"""


def steps_to_goal(env, planner, td, *, goal, steps):
    """Steps to the goal for each arena; all have to get there, and to all of it."""
    arrived = torch.full(td.batch_size, -1)
    for step in range(steps):
        arrived[(arrived < 0) & (td[K.COVERAGE].squeeze(-1) >= goal)] = step
        td = env.step(planner(td))
        assert not td["next", "safety", "collision"].any()
        td = env.step_mdp(td)
    assert (td[K.COVERAGE] == 1).all()
    assert (planner(td)["planner", "status"] == Status.COVERED).all()
    return arrived


def plan(trees, position, **options):
    options = {"share": 0.98, "iterations": 500} | options
    return annealing.plan(trees, position, LINES, **options)


def forests(n, *, size=18, n_trees=8, **options):
    env = forest_env(size=size, n_trees=n_trees, lidar_range=3.0, num_envs=n, **options)
    return env, env.reset()


def test_all_is_seen_by_two_moves_east():
    """From column 2 columns 0 to 5 are seen; columns 6 and 7 are from column 4."""
    env, td = env_for(TWO_ENDS, lidar_range=3.0)
    planner = Hindsight(1.0, 3.0, 100)
    taken = []
    for _ in range(4):
        td = planner(td)
        taken.append((td[K.ACTION].item(), Status(td["planner", "status"].item()).name))
        td = env.step_mdp(env.step(td))
    assert taken == [(5, "EXPLORING"), (5, "EXPLORING"), (0, "COVERED"), (0, "COVERED")]


@pytest.mark.parametrize("iterations", [0, 50])
def test_nothing_to_do(iterations):
    trees, position = world(BOXED_IN)
    assert not plan(trees, position, iterations=iterations).any()


def test_plan_covers_every_arena_and_improvement_shortens_it():
    env, td = forests(12, seed=1, max_steps=10**6)
    greedy = steps_to_goal(env, Hindsight(0.98, 3.0, 0), td.clone(), goal=0.98, steps=320)
    varied = steps_to_goal(env, Hindsight(0.98, 3.0, 3000), td.clone(), goal=0.98, steps=320)
    blind = steps_to_goal(env, NearestFrontier(), td.clone(), goal=0.98, steps=320)
    assert (varied <= greedy).all() and (varied < blind).all()
    assert varied.float().mean() < 0.9 * greedy.float().mean()


def test_batched_equals_singles_and_runs_repeat():
    _, td = forests(4, seed=2)
    together = plan(td[K.TREES], td[K.POSITION])
    for arena in range(4):
        alone = plan(td[K.TREES][arena], td[K.POSITION][arena])
        assert (alone == together[arena]).all()
    assert (
        plan(td[K.TREES].view(2, 2, 18, 18), td[K.POSITION].view(2, 2, 2)).flatten(0, 1) == together
    ).all()


def test_a_new_episode_is_planned_anew():
    """Arena 0 starts again elsewhere while arena 1 goes on."""
    env, td = forests(2, seed=3)
    planner = Hindsight(0.98, 3.0, 200)
    td = env.step_mdp(env.step(planner(td)))
    before = planner(td.clone())["planner", "path"]
    fresh = env.reset(given(env, td[K.TREES].flip(0)), set_state=True)
    for key in (K.TREES, K.POSITION, K.CELLS, K.STEP_COUNT):
        td[key][0] = fresh[key][0]
    after = planner(td)["planner", "path"]
    assert (after[1] == before[1]).all() and (after[0] != before[0]).any()
    assert (after[0] == plan(td[K.TREES][0], td[K.POSITION][0], iterations=200)).all()


def test_plan_sees_as_the_env_does():
    """No env, but the same rule: the walk's scans uncover what the plan counts on."""
    env = make_forest(lidar_range=3.0, num_envs=20, seed=4)
    td = env.reset()
    walk = plan(td[K.TREES], td[K.POSITION], share=1.0)
    for step in range(int((walk != 0).sum(-1).max())):
        td[K.ACTION] = walk[:, step].long()
        td = env.step_mdp(env.step(td))
    assert (td[K.COVERAGE] == 1).all()


@pytest.mark.parametrize("options", [{"coverage_goal": 0.0}, {"iterations": -1}])
def test_what_makes_no_sense_is_refused(options):
    with pytest.raises(ValueError, match="is not allowed"):
        Hindsight(**options)
