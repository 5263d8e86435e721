"""Planners against slow loops, and why they stop."""

import pytest
import torch
from hypothesis import given as each
from hypothesis import strategies as st
from tensordict import TensorDict

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import SafetyFilter
from forestrl.planners import (
    CostBased,
    InformationGain,
    NearestFrontier,
    PotentialField,
)
from forestrl.planners.explore_bench import corrected, published
from forestrl.planners.frontier.information_gain import information_gain
from forestrl.status import Status
from tests.drawing import draw, situation
from tests.envs.worlds import env_for, forest_env
from tests.planners import oracles
from tests.states import explored_state, explored_states, random_state

PLANNERS = {
    "nearest frontier": NearestFrontier,
    "gain": InformationGain,
    "cost": CostBased,
    "cost, corrected": lambda: CostBased("corrected"),
    "mmpf": PotentialField,
    "mmpf, corrected": lambda: PotentialField("corrected"),
}
SEEDS = st.integers(0, 10_000)
NONE = torch.tensor([-1, -1])


def drawn(text):
    cells, position = situation(text)
    trees = cells == F.Cell.OCCUPIED
    return TensorDict({K.CELLS: cells, K.POSITION: position, K.TREES: trees})


def state(seed, explored):
    """Trees, cells and position; a robot's own map, or one with any cell unknown."""
    if explored:
        return explored_state(seed)
    cells, position = random_state(seed)
    unknown_tree = torch.rand(cells.shape, generator=torch.Generator().manual_seed(seed)) < 0.3
    return (cells == F.Cell.OCCUPIED) | ((cells == 0) & unknown_tree), cells, position


def walk(planner, text, *, steps, lidar_range=5.0):
    """The states of an episode in a drawn world, with the planner's last word."""
    env, td = env_for(text, SafetyFilter(), lidar_range=lidar_range)
    states = []
    for _ in range(steps):
        states.append(planner(td))
        td = env.step_mdp(env.step(states[-1].clone()))
    return [*states, planner(td)]


def status(td):
    return Status(td["planner", "status"].item())


# Against the loops.


@pytest.mark.parametrize("explored", [True, False])
@pytest.mark.parametrize(("window", "power"), [(7, 1.0), (5, 0.5), (3, 0.0)])
@each(seed=SEEDS)
def test_information_gain_equals_its_loop(explored, window, power, seed):
    _, cells, position = state(seed, explored)
    action, _, _ = information_gain(cells, position, window=window, power=power)
    here = tuple(position.tolist())
    goal = oracles.gain_goal(cells.tolist(), here, window=window, power=power)
    assert action == oracles.towards(cells.tolist(), here, goal), draw(cells, position)


@pytest.mark.parametrize("explored", [True, False])
@pytest.mark.parametrize("name", ["cost", "mmpf"])
@each(seed=SEEDS)
def test_published_planner_equals_its_loop(name, explored, seed):
    trees, cells, position = state(seed, explored)
    action, why = getattr(published, name)(cells, position, trees)
    here, known = tuple(position.tolist()), cells.tolist()
    goal = getattr(oracles, f"{name}_goal")(known, here)
    expected = oracles.published(known, here, trees.tolist(), goal)
    assert (action.item(), Status(why.item()).name) == expected, draw(cells, position)


@pytest.mark.parametrize("explored", [True, False])
@pytest.mark.parametrize("name", ["cost", "mmpf"])
@each(seed=SEEDS)
def test_corrected_planner_equals_its_loop(name, explored, seed):
    _, cells, position = state(seed, explored)
    action, why, _ = getattr(corrected, name)(cells, position, NONE)
    here = tuple(position.tolist())
    expected = oracles.corrected(cells.tolist(), here, downhill=name == "mmpf")
    assert (action.item(), Status(why.item()).name) == expected, draw(cells, position)


@pytest.mark.parametrize("batch", [(5,), (2, 3)])
@pytest.mark.parametrize("name", PLANNERS)
def test_batched_equals_singles(name, batch):
    trees, cells, position = explored_states(3, batch)
    td = TensorDict({K.CELLS: cells, K.POSITION: position, K.TREES: trees}, batch_size=batch)
    singles = [PLANNERS[name]()(one.clone()) for one in td.reshape(-1).unbind(0)]
    together = PLANNERS[name]()(td.clone())
    for key in (K.ACTION, ("planner", "status")):
        assert together[key].flatten().tolist() == [one[key].item() for one in singles]


# By hand.


def test_information_gain_weighs_what_is_unknown_against_the_way():
    """West: 2 moves to 3 unknown cells. East: 4 moves, to 3 in a 3 x 3 window, 6 in 5 x 5."""
    text = """
        ? . T . . . . . ? ?
        ? . . A . . . . ? ?
        ? . T . . . . . ? ?
    """

    def action(window, power):
        return InformationGain(window, power)(drawn(text))[K.ACTION]

    assert action(3, 1.0) == 4  # 3/2 > 3/4
    assert action(3, 0.0) == 4  # 3 = 3: the first in row-major order
    assert action(5, 0.0) == 3  # 3 < 6
    assert action(5, 0.5) == 3  # 3/1.41 < 6/2
    assert action(5, 1.0) == 4  # 3/2 = 6/4
    assert action(5, 2.0) == 4  # 3/4 > 6/16


def test_nearest_cluster_is_the_goal_of_the_cost_planner():
    """Goals at (1, 1) and (3, 5). 4-connected moves: 2 and 4. The agent's own: 2 and 2, and the
    cluster with the last cell is the first."""
    text = """
        T T T T T T T
        ? . . A . . .
        ? . . . . . .
        ? . . . . . .
        T T T T T T ?
    """
    assert CostBased()(drawn(text))[K.ACTION] == 4
    assert CostBased("corrected")(drawn(text))[K.ACTION] == 8


def test_planners_stop_when_all_is_covered():
    text = """
        . . T
        . A .
        . . .
    """
    for name in set(PLANNERS) - {"mmpf"}:
        td = PLANNERS[name]()(drawn(text))
        assert td[K.ACTION] == 0 and status(td) == Status.COVERED


def test_planners_stop_when_the_rest_cannot_be_reached():
    """The unknown cells lie behind a wall."""
    text = """
        . . T . ?
        . A T . ?
        . . T . ?
    """
    for name in ("nearest frontier", "gain", "cost, corrected", "mmpf, corrected"):
        td = PLANNERS[name]()(drawn(text))
        assert td[K.ACTION] == 0 and status(td) == Status.NO_REACHABLE_FRONTIER


# How the published planners get stuck, and the corrected ones do not.

DIAGONAL_GAP = """
    . . . . . T T
    . . . . . . .
    . . . . T T A
    . . . T . . T
    . T . . . . .
    . . . . . . .
    . . . . . . .
"""
NO_STRICT_FRONTIER = """
    . . . . . T .
    . . . . . T A
    . . . . . . T
    . . . . . . .
    . . . . . . .
    . T . . . . T
    . . . . . . .
"""
LOCAL_MINIMUM = """
    . . . . . . T . . .
    . . . . T . . . . .
    . . . . . T T . . .
    . . . . T . . . . .
    . . . . . . . . . .
    . . . . T . . . . .
    . T . . . . . A . .
    . T . . . . T . . .
    T T . T T . . . . .
    T . . . T . . . . T
"""
POCKET = """
    A . . . . . .
    . . . . . T .
    . . . . T . T
    . . . . . T .
    . . . . . . .
    . . . . . . .
    . . . . . . .
"""
STUCK = {
    "a: distance 0 through a diagonal gap": (CostBased, DIAGONAL_GAP, 3.0, "CYCLE"),
    "c: no cell passes as a frontier": (
        CostBased,
        NO_STRICT_FRONTIER,
        2.0,
        "NO_REACHABLE_FRONTIER",
    ),
    "d: local minimum": (PotentialField, LOCAL_MINIMUM, 5.0, "CYCLE"),
    "e: all potentials are 0": (PotentialField, POCKET, 2.0, "GOAL_NOT_FREE"),
}


@pytest.mark.parametrize("name", STUCK)
def test_published_planner_gets_stuck(name):
    planner, text, lidar_range, why = STUCK[name]
    states = walk(planner(), text, steps=120, lidar_range=lidar_range)
    assert status(states[-1]).name == why
    assert states[-1][K.COVERAGE] < 0.98 and states[-1][K.ACTION] == 0
    assert (states[-1][K.POSITION] == states[-2][K.POSITION]).all()


@pytest.mark.parametrize("name", STUCK)
def test_corrected_planner_does_not_get_stuck_there(name):
    planner, text, lidar_range, _ = STUCK[name]
    last = walk(planner("corrected"), text, steps=150, lidar_range=lidar_range)[-1]
    assert status(last) == Status.COVERED and last[K.COVERAGE] == 1


def test_published_cost_planner_is_done_where_its_goal_is_its_own_cell():
    """b: the agent's cell is the first free one around the cluster's centre, which it cannot see;
    our LiDAR always shows the eight neighbours, so that no episode gets there."""
    text = """
        T T T T T
        T A . . T
        T . ? . T
        T . . . T
        T T T T T
    """
    td = CostBased()(drawn(text))
    assert td[K.ACTION] == 0 and status(td) == Status.AT_GOAL


def test_cycle_of_the_diagonal_gap_has_two_cells():
    """Left alone, the planner alternates between the two sides of the gap."""
    planner = CostBased()
    env, td = env_for(DIAGONAL_GAP, SafetyFilter(), lidar_range=3.0)
    positions = []
    for _ in range(80):
        td[K.ACTION] = planner(td.exclude("planner"))[K.ACTION]
        td = env.step_mdp(env.step(td))
        positions.append(tuple(td[K.POSITION].tolist()))
    assert len(set(positions[-20:])) == 2 and positions[-1] == positions[-3]


# Status and memory.


def test_a_cycle_is_told_only_when_position_and_map_repeat():
    """Wherever the planner says so, it does go round: run without memory, nothing more is seen."""
    env = forest_env(size=20, n_trees=12, lidar_range=3.0, num_envs=40, max_steps=10**6, seed=5)
    start = env.reset()
    planner, td = CostBased(), start.clone()
    for _ in range(250):
        td = env.step_mdp(env.step(planner(td)))
    ended = planner(td)["planner", "status"]
    other = start.clone()
    for _ in range(500):
        other[K.ACTION] = planner(other.exclude("planner"))[K.ACTION]
        other = env.step_mdp(env.step(other))
    assert (ended == Status.CYCLE).any() and (ended != Status.CYCLE).any()
    assert (ended != Status.EXPLORING).all()
    assert (td[K.CELLS] == other[K.CELLS]).all()


def test_memory_starts_afresh_with_an_episode():
    planner = CostBased()
    last = walk(planner, DIAGONAL_GAP, steps=120, lidar_range=3.0)[-1]
    assert status(last) == Status.CYCLE
    last[K.STEP_COUNT] = torch.zeros_like(last[K.STEP_COUNT])
    assert status(planner(last)) == Status.EXPLORING and last[K.ACTION] != 0


def test_a_planner_goes_on_when_something_new_is_seen():
    planner = CostBased()
    last = walk(planner, DIAGONAL_GAP, steps=120, lidar_range=3.0)[-1]
    unknown = (last[K.CELLS] == F.Cell.UNKNOWN).nonzero()[0]
    last[K.CELLS][tuple(unknown)] = int(F.Cell.OCCUPIED)
    assert status(planner(last)) == Status.EXPLORING


@pytest.mark.parametrize("name", ["nearest frontier", "gain", "cost, corrected", "mmpf, corrected"])
def test_planner_covers_every_arena_without_interventions(name):
    env, planner = env_for(LOCAL_MINIMUM, SafetyFilter())[0], PLANNERS[name]()
    for seed in range(5):
        env.base_env.n_trees = 4
        env.set_seed(seed)
        td = env.reset()
        for _ in range(200):
            td = env.step(planner(td))
            assert not td["next", "safety", "intervened"]
            td = env.step_mdp(td)
        assert td[K.COVERAGE] == 1 and status(planner(td)) == Status.COVERED


@pytest.mark.parametrize("name", ["gain", "cost, corrected", "mmpf, corrected"])
def test_planner_does_not_know_the_hidden_trees(name):
    trees, cells, position = explored_state(7)
    td = TensorDict({K.CELLS: cells, K.POSITION: position, K.TREES: trees})
    other = td.clone().set(K.TREES, ~trees)
    assert PLANNERS[name]()(td)[K.ACTION] == PLANNERS[name]()(other)[K.ACTION]


@pytest.mark.parametrize("variant", ["other", ""])
def test_unknown_variant_is_refused(variant):
    for planner in (CostBased, PotentialField):
        with pytest.raises(ValueError, match=f"variant={variant}"):
            planner(variant)


@pytest.mark.parametrize("options", [{"window": 4}, {"window": 1}, {"power": -1.0}])
def test_information_gain_refuses_what_makes_no_sense(options):
    with pytest.raises(ValueError, match="is not allowed"):
        InformationGain(**options)
