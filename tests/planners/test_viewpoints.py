"""What could be seen from where, path gain and the linear score against slow loops."""

import numpy as np
import pytest
import torch
from hypothesis import given as each
from hypothesis import strategies as st
from tensordict import TensorDict

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import SafetyFilter
from forestrl.explorer import LinearScore
from forestrl.functional import sight_lines
from forestrl.planners import PathGain
from forestrl.planners.viewpoints.sight import sight
from forestrl.planners.viewpoints.views import blank, update
from forestrl.status import Status
from tests.envs.worlds import env_for
from tests.planners import viewpoints as slow
from tests.states import explored_state, random_state

SEEDS = st.integers(0, 10_000)
RANGES = st.sampled_from([2.0, 3.0, 5.0, 5.5, 8.0])
ACTION = {move: number for number, move in enumerate(slow.MOVES, 1)}


def known(seed, lidar_range):
    """A robot's own map, or one with any cell unknown, not always square."""
    if seed % 2:
        return explored_state(seed, lidar_range=lidar_range)[1:]
    return random_state(seed, height=7 + seed % 5, width=6 + seed % 7)


def decided(planner, cells, position):
    td = planner(TensorDict({K.CELLS: cells, K.POSITION: position}))
    return td[K.ACTION].item(), td


def searched(cells, position, lidar_range):
    world = slow.Map(cells.tolist(), sight_lines(lidar_range))
    return world, slow.Paths(world, tuple(position.tolist()))


def towards(paths, goal):
    step = paths.way(goal)[0]
    return ACTION[step[0] - paths.start[0], step[1] - paths.start[1]]


@each(SEEDS, RANGES, st.sampled_from([0.0, 1.0, 1.4]))
def test_path_gain_equals_its_loop(seed, lidar_range, power):
    cells, position = known(seed, lidar_range)
    world, paths = searched(cells, position, lidar_range)
    goal = slow.path_gain_goal(world, paths, power)
    action, td = decided(PathGain(lidar_range, power), cells, position)
    assert action == (0 if goal is None else towards(paths, goal))
    assert (td[K.STATUS] == Status.EXPLORING) == (goal is not None)


@each(SEEDS, RANGES)
def test_what_could_be_seen_is_kept_up_as_the_map_grows_or_jumps(seed, lidar_range):
    rng = np.random.default_rng(seed)
    rows, cols = rng.integers(5, 14, 2)
    lines = sight(lidar_range, int(cols))
    views = blank(int(rows), int(cols), lines)
    truth, seen = rng.choice([1, 2], (rows, cols), p=[0.8, 0.2]), np.zeros((rows, cols), bool)
    before = np.zeros((rows, cols), np.uint8)
    for step in range(5):
        seen |= rng.random((rows, cols)) < 0.2
        if step == 3:
            truth = rng.permutation(truth.ravel()).reshape(rows, cols)  # another world
        cells = np.where(seen, truth, 0).astype(np.uint8)
        follows = bool(((before == 0) | (before == cells)).all())
        assert update(views, lines, cells) == follows and (step == 3 or follows)
        before = cells
        anew = blank(int(rows), int(cols), lines)
        update(anew, lines, cells)
        for kept, fresh in zip(views, anew, strict=True):
            np.testing.assert_array_equal(kept, fresh)


@each(SEEDS, RANGES)
def test_linear_score_goes_where_its_loop_is_highest(seed, lidar_range):
    cells, position = known(seed, lidar_range)
    world, paths = searched(cells, position, lidar_range)
    rng = np.random.default_rng(seed)
    weights, heading = rng.normal(size=14), rng.normal(size=2) * (seed % 3 > 0)
    last = (int(rng.integers(len(cells))), int(rng.integers(len(cells[0])))) if seed % 5 else None
    td = TensorDict({K.CELLS: cells, K.POSITION: position})
    policy = linear(weights, lidar_range).make_policy()
    td = remembering(policy, td, heading, last, lidar_range)
    td = policy(td)
    if not paths.goals():
        assert td[K.ACTION] == 0 and td[K.STATUS] != Status.EXPLORING
        return
    scores = {
        cell: slow.linear_score(
            slow.terms(world, paths, cell, lidar_range, heading, last, np.exp(weights[1])), weights
        )
        for cell in paths.goals()
    }
    margin = sight(lidar_range, cells.shape[1]).margin
    stride = cells.shape[1] + 2 * margin
    number = td["planner", "goal"].item()
    goal = number // stride - margin, number % stride - margin
    assert scores[goal] >= max(scores.values()) - 1e-9
    assert td[K.ACTION] == towards(paths, goal)


def remembering(policy, td, heading, last, lidar_range):
    """Puts heading and last goal in place of what a first call has left."""
    td = policy(td)
    margin = sight(lidar_range, td[K.CELLS].shape[-1]).margin
    stride = td[K.CELLS].shape[-1] + 2 * margin
    goal = -1 if last is None else (last[0] + margin) * stride + last[1] + margin
    td["planner", "heading"] = torch.tensor(heading, dtype=torch.float64)
    td["planner", "goal"] = torch.tensor([goal])
    td["planner", "idle"] = torch.zeros(2, dtype=torch.int64)
    return td


def linear(weights, lidar_range=5.0):
    score = LinearScore(lidar_range)
    score.weights.copy_(torch.as_tensor(weights))
    return score


POLICIES = {
    "path gain": PathGain,
    "linear": lambda: LinearScore().make_policy(),
    "wavering": lambda: linear([-3.0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, -9, 0, 0]).make_policy(),
}
ROOMS = """
    A . . . . . . . T . . .
    . . T T . . . . T . . .
    . . . . . T . . . . T .
    . T . . . . . . T . . .
    . . . . T . . . T . . .
    . . . . . . . . T T . T
"""


@pytest.mark.parametrize("name", POLICIES)
def test_all_is_covered_without_interventions(name):
    env, td = env_for(ROOMS, SafetyFilter(), lidar_range=3.0)
    policy = POLICIES[name]()
    for _ in range(400):
        td = env.step(policy(td))
        assert not td["next", "safety", "intervened"]
        td = env.step_mdp(td)
    assert td[K.COVERAGE] == 1 and policy(td)[K.STATUS] == Status.COVERED


@pytest.mark.parametrize("name", POLICIES)
def test_hidden_trees_are_not_known(name):
    trees, cells, position = explored_state(7)
    td = TensorDict({K.CELLS: cells, K.POSITION: position, K.TREES: trees})
    other = td.clone().set(K.TREES, ~trees)
    assert POLICIES[name]()(td)[K.ACTION] == POLICIES[name]()(other)[K.ACTION]


@pytest.mark.parametrize("name", POLICIES)
def test_a_batch_fares_as_its_arenas_alone(name):
    states = [explored_state(seed)[1:] for seed in range(20)]
    cells, position = (torch.stack(parts) for parts in zip(*states, strict=True))
    batch = POLICIES[name]()(TensorDict({K.CELLS: cells, K.POSITION: position}, [20]))
    alone = [decided(POLICIES[name](), *state)[0] for state in states]
    assert batch[K.ACTION].tolist() == alone


def test_the_guard_chooses_only_where_a_policy_wavers():
    """A score that pushes away from the last goal turns round for ever; the guard ends it."""
    guarded = {}
    for name in ("linear", "wavering"):
        env, td = env_for(ROOMS, SafetyFilter(), lidar_range=3.0)
        policy, guarded[name] = POLICIES[name](), 0
        for _ in range(400):
            td = policy(td)
            guarded[name] += td[K.GUARDED].item()
            td = env.step_mdp(env.step(td))
        assert td[K.COVERAGE] == 1
    assert guarded["linear"] == 0 < guarded["wavering"]


@pytest.mark.parametrize(
    ("options", "word"), [({"power": -1.0}, "power"), ({"lidar_range": 0.0}, "lidar_range")]
)
def test_path_gain_refuses_what_makes_no_sense(options, word):
    with pytest.raises(ValueError, match=f"{word}=.* is not allowed"):
        PathGain(**options)


def test_a_policy_that_is_always_deterministic_cannot_sample():
    with pytest.raises(ValueError, match="always deterministic"):
        LinearScore().make_policy(deterministic=False)


def test_path_gain_sees_more_on_the_diagonal():
    """With an empty unknown field all around, a diagonal move shows most."""
    cells = torch.zeros(21, 21, dtype=torch.uint8)
    reach = F.sight_lines(5.0).offsets + 10
    cells[reach[:, 0], reach[:, 1]] = F.Cell.FREE
    cells[10, 10] = F.Cell.FREE
    assert decided(PathGain(), cells, torch.tensor([10, 10]))[0] in (1, 3, 6, 8)
