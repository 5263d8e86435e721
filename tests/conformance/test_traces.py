"""Ten worlds played by an independent implementation of the specification, reproduced step by step.

``traces.json`` is data: ``params``, ``occupancy`` (``#`` trunk), ``start``, the state after
``reset``, the ``steps``, and some ``graphs``.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch
from torchrl.envs import Compose, TransformedEnv
from torchrl.envs.utils import step_mdp

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import (
    ExplorationGraph,
    ForestEnv,
    FrontierPotentialReward,
    RandomForest,
    SafetyFilter,
)
from tests import oracles
from tests.drawing import draw, parse_cells
from tests.graphs import edges_by_node, features_by_node

TRACES = json.loads((Path(__file__).parent / "traces.json").read_text())
MAX_FRONTIERS = 256


def trees_of(trace: dict) -> torch.Tensor:
    return torch.tensor([[letter == "#" for letter in row] for row in trace["occupancy"]])


def make_env(trace: dict, num_envs: int | None = None) -> TransformedEnv:
    params = trace["params"]
    lidar_range, goal = params["lidar_range"], params["coverage_goal"]
    window, beta = params["window"], params["beta"]
    occupancy = trace["occupancy"]
    env = ForestEnv(
        RandomForest((len(occupancy), len(occupancy[0])), n_trees=0),
        lidar_range=lidar_range,
        coverage_goal=goal,
        max_steps=len(trace["steps"]) + 1,
        num_envs=num_envs,
    )
    graph = ExplorationGraph(window=window, max_frontiers=MAX_FRONTIERS)
    reward = FrontierPotentialReward(beta=beta)
    return TransformedEnv(env, Compose(SafetyFilter(), graph, reward))


def start(env: TransformedEnv, trace: dict):
    """Resets into the trace's world, once for each arena of the env."""
    td = env.fake_tensordict().select(K.TREES, K.POSITION)
    td[K.TREES] = trees_of(trace).expand_as(td[K.TREES]).clone()
    td[K.POSITION] = torch.tensor(trace["start"]).expand_as(td[K.POSITION]).clone()
    return env.reset(td, set_state=True)


def play(env: TransformedEnv, trace: dict):
    """Yields the step's record and the state after it, the reset first."""
    td = start(env, trace)
    yield trace["reset"], td, None
    for step in trace["steps"]:
        td["action"] = torch.full(env.batch_size, step["action"])
        td = env.step(td)
        yield step, td["next"], td["action"]
        td = step_mdp(td)


def check_state(record: dict, state) -> None:
    """What a record of a reset and one of a step have in common."""
    assert state[K.NEW_CELLS].unique().tolist() == [record["new_cells"]]
    assert state[K.FRONTIERS].unique().tolist() == [record["frontiers"]]
    for key, name in ((K.COVERAGE, "coverage"), (K.POTENTIAL, "potential")):
        expected = torch.full_like(state[key], record[name])
        torch.testing.assert_close(state[key], expected, rtol=0, atol=1e-5)


@pytest.mark.parametrize("num_envs", [None, 2])
@pytest.mark.parametrize("trace", TRACES, ids=lambda trace: trace["name"])
def test_env_and_transforms_reproduce_the_trace(trace, num_envs):
    played = 0
    for record, state, action in play(make_env(trace, num_envs), trace):
        check_state(record, state)
        if action is None:
            feasible = torch.tensor(record["feasible"])
            assert torch.equal(state[K.FEASIBLE], feasible.expand_as(state[K.FEASIBLE]))
            continue
        shape = (*action.shape, 1)
        assert torch.equal(action, torch.full_like(action, record["action"]))
        assert torch.equal(state[K.EXECUTED], torch.full_like(action, record["executed"]))
        assert torch.equal(state[K.INTERVENED], torch.full(shape, record["intervened"]))
        assert not state[K.COLLISION].any()
        position = torch.tensor(record["position"])
        assert torch.equal(state[K.POSITION], position.expand(*action.shape, 2))
        reward = torch.full(shape, record["reward"])
        torch.testing.assert_close(state["reward"], reward, rtol=0, atol=1e-5)
        assert torch.equal(state["terminated"], torch.full(shape, record["terminated"]))
        assert torch.equal(state["done"], state["terminated"])  # the budget is one step longer
        played += 1
    assert played == len(trace["steps"]) > 0


@pytest.mark.parametrize("trace", TRACES, ids=lambda trace: trace["name"])
def test_the_maps_and_graphs_of_the_trace_are_observed(trace):
    graphs = {graph["after_step"]: graph for graph in trace["graphs"]}
    lidar_range = trace["params"]["lidar_range"]
    for step, (_, state, _) in enumerate(play(make_env(trace), trace)):
        if step not in graphs:
            continue
        graph = graphs.pop(step)
        cells, position = state[K.CELLS], state[K.POSITION]
        assert draw(cells) == draw(parse_cells("\n".join(graph["map"]).replace("#", "T")))
        found = F.Graph(*(state[key] for key in (K.NODES, K.WAYPOINT, K.LENGTH, K.FRONTIERS)))
        names = [(min(i, 9), *cell) for i, cell in enumerate(graph["node_cells"])]
        features = features_by_node(found, cells, position)
        assert features.keys() == set(names) and len(features) == len(names)
        for name, row in zip(names, graph["x"], strict=True):
            assert features[name] == pytest.approx(row, abs=1e-5)
        assert not found.x[len(names) :].any()
        expected = {(names[s], names[t]): length for s, t, length in graph["edges"]}
        assert len(expected) == len(graph["edges"])
        edges = edges_by_node(found, cells, position, lidar_range=lidar_range)
        assert edges.keys() == expected.keys()
        assert edges == pytest.approx(expected, abs=1e-5)
    assert not graphs


@pytest.mark.parametrize("trace", TRACES, ids=lambda trace: trace["name"])
def test_the_oracles_of_the_tests_agree_with_the_trace(trace):
    """So that a test against an oracle is one against the specification."""
    params = trace["params"]
    window, beta, goal = params["window"], params["beta"], params["coverage_goal"]
    trees = trees_of(trace).tolist()
    position, cells = tuple(trace["start"]), [[oracles.UNKNOWN] * len(row) for row in trees]
    traversable = oracles.component((~trees_of(trace)).tolist(), position)
    potential = 0.0
    for record in [trace["reset"], *trace["steps"]]:
        if "action" in record:
            action = oracles.safe_action(record["action"], oracles.feasible(cells, position))
            assert action == record["executed"]
            position = oracles.add(position, oracles.TABLE_1[action])
            assert list(position) == record["position"]
        new = 0
        for row, col in oracles.scan(trees, position, params["lidar_range"]):
            new += cells[row][col] == oracles.UNKNOWN
            cells[row][col] = oracles.OCCUPIED if trees[row][col] else oracles.FREE
        assert new == record["new_cells"]
        if "feasible" in record:
            assert oracles.feasible(cells, position) == record["feasible"]
        assert len(oracles.frontier(cells)) == record["frontiers"]
        coverage = oracles.coverage(cells, traversable)
        assert coverage == pytest.approx(record["coverage"], abs=1e-9)
        before, potential = potential, oracles.potential(cells, position, side=window, beta=beta)
        assert potential == pytest.approx(record["potential"], abs=1e-9)
        if "action" in record:
            explored, unsafe = coverage >= goal, record["intervened"]
            reward = oracles.reward(new, before, potential, explored=explored, unsafe=unsafe)
            assert reward == pytest.approx(record["reward"], abs=1e-9)
            assert record["terminated"] == explored
