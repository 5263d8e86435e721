"""The decision of a robot equals that of the env, step by step."""

import pytest
import torch

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import ExplorationGraph
from forestrl.planner import Planner
from forestrl.planners import CostBased, InformationGain, NearestFrontier
from forestrl.policies.actor_critic import LearnedPolicy
from forestrl.policies.files import (
    CheckpointError,
    Described,
    load_policy,
    save_policy,
)
from forestrl.released import MODELS, RELEASED
from forestrl.status import Status
from tests.drawing import situation
from tests.envs.worlds import make_forest, make_transformed

PLANNERS = [NearestFrontier, InformationGain, lambda: CostBased("corrected")]


def follow(env, planner, policy, steps):
    """Walks in the env by its own policy and asks the planner the same at every step."""
    td = env.reset()
    for _ in range(steps):
        td = policy(td)
        decision = planner.decide(td[K.CELLS], td[K.POSITION].tolist())
        assert decision.proposed == td[K.ACTION].item()
        td = env.step(td)
        assert decision.action == td["next"].get(K.EXECUTED, td[K.ACTION]).item()
        assert decision.intervened == (decision.action != decision.proposed)
        td = env.step_mdp(td)
        yield decision, td


def test_a_learned_policy_decides_as_in_the_env():
    env = make_transformed(size=15, n_trees=10, lidar_range=3.0)
    policy = load_policy(RELEASED["paper"]).build(MODELS, lidar_range=3.0)
    planner = Planner.from_file(RELEASED["paper"], lidar_range=3.0, deterministic=True)
    env.transform[1].max_frontiers = planner.observe.max_frontiers
    done = list(follow(env, planner, policy.make_policy(deterministic=True), 25))
    assert len({decision.action for decision, _ in done}) > 2
    for decision, _ in done:
        assert sum(decision.probabilities) == pytest.approx(1, abs=1e-5)
        assert decision.status == Status.EXPLORING


@pytest.mark.parametrize("make", PLANNERS)
def test_a_classical_planner_decides_as_in_the_env_and_remembers(make):
    env = make_forest(size=15, n_trees=10, lidar_range=3.0, max_steps=10**6)
    planner = Planner(make())
    done = list(follow(env, planner, make(), 150))
    assert done[-1][0].status == Status.COVERED and done[0][0].status == Status.EXPLORING
    assert all(decision.probabilities is None for decision, _ in done)
    planner.reset()
    assert planner.decide(*_start()).status == Status.EXPLORING


def _start():
    cells, position = situation(". . ?\n. A ?\n. . .")
    return cells, position.tolist()


def test_the_filter_guards_every_answer():
    cells, position = situation("T T T\nT A .\nT T T")
    always_north = LearnedPolicy(_North(), deterministic=True)
    decision = Planner(always_north).decide(cells, position.tolist())
    assert (decision.proposed, decision.action, decision.intervened) == (2, 5, True)


class _North(torch.nn.Module):
    in_keys = (K.POSITION,)

    def forward(self, position):
        return (
            torch.nn.functional.one_hot(torch.tensor(2), 9).float().expand(*position.shape[:-1], 9)
        )


@pytest.mark.parametrize("position", [(-1, 0), (0, 3), (3, 0)])
def test_a_cell_outside_the_map_is_refused(position):
    cells, _ = situation(". . .\n. A .\n. . .")
    with pytest.raises(ValueError, match=r"is not a cell of \[3, 3\]"):
        Planner(NearestFrontier()).decide(cells, position)


def test_an_observation_that_is_not_known_is_refused(tmp_path):
    policy = load_policy(RELEASED["paper"])
    settings = vars(policy) | {"observation": Described("mine.Observation", {})}
    save_policy(tmp_path / "x", type(policy)(**settings))
    with pytest.raises(CheckpointError, match=r"reads 'mine.Observation', which is not one of"):
        Planner.from_file(tmp_path / "x")


def test_the_parts_that_a_planner_is_made_of_are_those_of_the_env():
    """An own observation and a policy of one's own, without any file."""
    observe = ExplorationGraph(lidar_range=5.0)
    policy = load_policy(RELEASED["paper"]).build(MODELS).make_policy(True)
    cells, position = situation(". . ?\n. A ?\n. . .")
    decision = Planner(policy, observe).decide(cells, position.tolist())
    graph = F.exploration_graph(cells, position, window=7, max_frontiers=256, lidar_range=5.0)
    assert decision.proposed == policy.actor(*graph).argmax().item()
