"""What is measured while training, by hand."""

import math

import pytest
import torch
from tensordict import TensorDict

from forestrl import keys as K
from forestrl.envs import (
    ExplorationGraph,
    FrontierPotentialReward,
    SafetyFilter,
    StaggeredEpisodes,
)
from forestrl.learning.metrics import summarize
from tests.envs.worlds import make_transformed


def column(*values, dtype=torch.float32):
    return torch.tensor([values], dtype=dtype).unsqueeze(-1)


def flags(*values):
    return column(*values, dtype=torch.bool)


TRANSFORMS = (
    SafetyFilter(),
    ExplorationGraph(max_frontiers=8),
    FrontierPotentialReward(coverage_goal=0.98),
)


def measured(batch):
    return summarize(batch, TRANSFORMS)


@pytest.fixture
def batch():
    """One arena, five steps.

    0: 4 new cells, the potential rises by 0.25; coverage 0.7 to 0.85
    1: replaced by staying, r_sigma
    2: reaches rho*, r_exp; the episode ends
    3: 2 new cells, the potential falls by 0.5; coverage 0.1 to 0.2
    4: replaced by a move; the episode is cut
    """
    after = {
        "reward": column(4.25, -5, 100, 1.5, -5),
        "done": flags(0, 0, 1, 0, 1),
        "terminated": flags(0, 0, 1, 0, 0),
        "episode_reward": column(4.25, -0.75, 99.25, 1.5, -3.5),
        K.STEP_COUNT: column(10, 11, 12, 1, 2, dtype=torch.int64),
        K.COVERAGE: column(0.85, 0.85, 0.99, 0.2, 0.3),
        K.NEW_CELLS: column(4, 0, 9, 2, 3),
        K.COLLISION: flags(0, 0, 0, 0, 0),
        K.EXECUTED: torch.tensor([[1, 0, 3, 4, 5]]),
        K.INTERVENED: flags(0, 1, 0, 0, 1),
    }
    before = {
        K.ACTION: torch.tensor([[1, 2, 3, 4, 6]]),
        K.COVERAGE: column(0.7, 0.85, 0.85, 0.1, 0.2),
        K.FRONTIERS: column(3, 9, 8, 0, 10, dtype=torch.int64),
        K.WAYPOINT: torch.ones(1, 5, 8, dtype=torch.int64),
    }
    batch = TensorDict(before, batch_size=(1, 5))
    batch["next"] = TensorDict(after, batch_size=(1, 5))
    return batch


EXPECTED = {
    "rollout/return": (99.25 - 3.5) / 2,
    "rollout/coverage": (0.99 + 0.3) / 2,
    "rollout/episode_length": (12 + 2) / 2,
    "rollout/finished": 1 / 2,
    "rollout/steps_to_80": 10,
    "rollout/steps_to_90": 12,
    "rollout/steps_to_98": 12,
    "safety/intervention_rate": 2 / 5,
    "safety/null_actions": 1 / 5,
    "safety/collisions": 0,
    "reward/new_cells": (4 + 2) / 5,
    "reward/potential": (0.25 - 0.5) / 5,
    "reward/explored": 100 / 5,
    "reward/unsafe": -10 / 5,
    "graph/frontiers": 30 / 5,
    "graph/truncated": 2 / 5,
}


@pytest.mark.parametrize(("name", "value"), EXPECTED.items())
def test_metric_by_hand(name, value, batch):
    assert math.isclose(measured(batch)[name], value, rel_tol=1e-5, abs_tol=1e-6)


def test_there_are_no_other_metrics(batch):
    assert measured(batch).keys() == EXPECTED.keys()


def test_reward_terms_add_up_to_the_mean_reward(batch):
    terms = [value for name, value in measured(batch).items() if name.startswith("reward/")]
    assert math.isclose(sum(terms), batch["next", "reward"].mean(), rel_tol=1e-5)


def test_a_replaced_step_that_reaches_the_goal_is_unsafe(batch):
    batch["next", K.INTERVENED][0, 2] = True
    batch["next", "reward"][0, 2] = -5.0
    metrics = measured(batch)
    assert metrics["reward/explored"] == 0
    assert math.isclose(metrics["reward/unsafe"], -15 / 5)


def test_levels_and_episodes_that_did_not_occur_are_nan(batch):
    nothing = measured(batch[:, 3:4])
    for name, value in nothing.items():
        assert math.isnan(value) == name.startswith("rollout/"), name


def test_without_a_filter_collisions_count_as_unsafe(batch):
    batch["next"] = batch["next"].exclude(K.EXECUTED, K.INTERVENED)
    batch["next", K.COLLISION][:] = flags(0, 1, 0, 0, 1)
    metrics = summarize(batch, TRANSFORMS[1:])
    assert metrics["safety/collisions"] == 2
    assert metrics["safety/intervention_rate"] == 0
    assert metrics["safety/null_actions"] == 0  # the policy's own actions
    assert math.isclose(metrics["reward/unsafe"], -10 / 5)


def test_reward_terms_add_up_in_a_real_rollout():
    torch.manual_seed(0)
    env = make_transformed(num_envs=4, coverage_goal=0.5)
    env.append_transform(StaggeredEpisodes(20))
    batch = env.rollout(60, break_when_any_done=False)
    batch["next", "episode_reward"] = torch.zeros_like(batch["next", "reward"])
    metrics = summarize(batch, env.transform)
    terms = [value for name, value in metrics.items() if name.startswith("reward/")]
    assert all(terms)
    assert math.isclose(sum(terms), batch["next", "reward"].mean(), rel_tol=1e-4)


def test_the_reward_of_a_user_is_measured_as_a_whole_and_by_its_own_terms(batch):
    """A transform that knows its own terms tells them; else only the mean is sure."""

    class Bold:
        def metrics(self, batch):
            return {"reward/boldness": 3.0}

    assert summarize(batch)["reward/mean"] == batch["next", "reward"].mean()
    with_terms = summarize(batch, [Bold()])
    assert with_terms["reward/boldness"] == 3.0 and "reward/mean" not in with_terms
    assert not any(name.startswith(("reward/unsafe", "graph/")) for name in with_terms)
