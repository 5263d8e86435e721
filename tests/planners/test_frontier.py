"""Planners in drawn situations."""

import pytest
import torch
from tensordict import TensorDict

from forestrl import functional as F
from forestrl import keys as K
from forestrl.planners import NearestFrontier, RandomWalk
from tests.drawing import situation, world
from tests.envs.worlds import given, make_transformed

DRAWS = 900
STAY, NORTH_WEST, NORTH, NORTH_EAST, WEST, EAST, SOUTH_WEST, SOUTH, SOUTH_EAST = range(9)
TIGHT = """
    . . T
    T A .
    T . ?
"""
BOXED_IN = """
    T T T
    T A T
    T T T
"""


def drawn(text):
    cells, position = situation(text)
    return TensorDict({K.CELLS: cells, K.POSITION: position})


def actions(text, **options):
    """The actions of a random walk for a regular grid of draws."""
    td = drawn(text).expand(DRAWS).clone()
    td[K.UNIFORM] = (torch.arange(DRAWS) + 0.5) / DRAWS
    return RandomWalk(**options)(td)[K.ACTION].tolist()


def goal(text):
    return NearestFrontier()(drawn(text))[K.ACTION].item()


def test_random_walk_is_uniform_over_feasible_moves():
    taken = actions(TIGHT)
    assert set(taken) == {NORTH_WEST, NORTH, EAST, SOUTH}
    assert {taken.count(action) for action in set(taken)} == {DRAWS // 4}


def test_random_walk_stays_only_if_boxed_in():
    assert set(actions(BOXED_IN)) == {STAY}


@pytest.mark.parametrize("text", [TIGHT, BOXED_IN])
def test_random_walk_over_all_actions_uses_all_nine(text):
    taken = actions(text, feasible_only=False)
    assert [taken.count(action) for action in range(9)] == [DRAWS // 9] * 9


def test_random_walk_is_never_replaced():
    env = make_transformed(num_envs=4)
    env.set_seed(0)
    policy = RandomWalk()

    def act(td):
        return policy(td.set(K.UNIFORM, torch.rand(td.batch_size)))

    after = env.rollout(100, act, break_when_any_done=False)["next"]
    assert not after[K.INTERVENED].any() and not after[K.COLLISION].any()


def test_nearest_frontier_goes_straight_there():
    assert goal("A . . . ?") == EAST
    assert goal("? . . A .") == WEST
    assert (
        goal("""
        A . . .
        . . . .
        . . . .
        . . . ?
    """)
        == SOUTH_EAST
    )


def test_nearest_frontier_takes_the_nearer_one():
    assert goal("? . . A . ?") == EAST
    assert goal("? . A . . ?") == WEST


def test_nearest_frontier_counts_the_path_and_not_the_distance():
    """The frontier in the south is three rows away but behind a wall."""
    assert (
        goal("""
        . A . . . . ?
        T T T T T T T
        . . . . . . T
        ? ? ? ? ? ? ?
    """)
        == EAST
    )


def test_nearest_frontier_goes_round_a_wall():
    assert (
        goal("""
        . . . . .
        . A . T .
        T T T T .
        ? . . . .
    """)
        == NORTH_EAST
    )


@pytest.mark.parametrize(
    "text",
    [
        ". . .\n. A .\n. . .",
        BOXED_IN,
        "A . T . ?",
    ],
    ids=["all known", "boxed in", "out of reach"],
)
def test_nearest_frontier_stays_without_a_frontier_in_reach(text):
    assert goal(text) == STAY


def test_nearest_frontier_stays_on_a_frontier_it_stands_on():
    """Its scan leaves no unknown cell around it, so that this lasts for no more than a drawing."""
    assert goal("A ?") == STAY


def test_equally_near_frontiers_tie_to_the_first_in_row_major_order():
    assert goal("? . . A . . ?") == WEST
    assert (
        goal("""
        . . .
        . A .
        . . .
        ? . ?
    """)
        == SOUTH_WEST
    )


def test_equally_good_moves_tie_to_the_lower_index():
    """South and south-east, 7 and 8, each begin a shortest path two rows down and one column on."""
    assert (
        goal("""
        A . .
        . . .
        . . .
        . . ?
    """)
        == SOUTH
    )


def test_a_batch_is_planned_arena_by_arena():
    texts = ("A . . ?", "? . . A", "? . A .", "A . . .")
    alone = torch.stack([NearestFrontier()(drawn(text))[K.ACTION] for text in texts])
    batch = torch.stack([drawn(text) for text in texts])
    assert NearestFrontier()(batch)[K.ACTION].equal(alone)
    assert alone.tolist() == [EAST, WEST, WEST, STAY]


def test_nearest_frontier_explores_everything_and_is_never_replaced():
    trees, position = world("""
        A . . T . . . . .
        . T . T . . T . .
        . T . T . T T T .
        . T . . . T . . .
        . T T T T T . T T
        . . . . . . . . .
        T T . T T T . T .
        . . . T . . . T .
        . T . . . T . . .
    """)
    env = make_transformed(lidar_range=2.0)
    start = env.reset(given(env, trees, position), set_state=True)
    after = env.rollout(100, NearestFrontier(), tensordict=start, auto_reset=False)["next"]
    assert after[K.COVERAGE][-1] >= 0.98 and after["terminated"][-1]
    assert not after[K.INTERVENED].any()
    assert not (after[K.EXECUTED] == F.NULL_ACTION).any()
