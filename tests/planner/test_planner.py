"""The planner of a robot: statuses with reasons, safety, and what it remembers."""

from __future__ import annotations

import json
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forestrl.planner import Planner, PlannerStatus
from tests.drawing import rows_of

VALUES = {"?": -1, ".": 0, "T": 100, "A": 0}


def drawn(text, resolution=1.0, origin=(0.0, 0.0)):
    """A drawing as grid and pose; its first line is the row at the least y."""
    rows = rows_of(text)
    row, col = next(((r, line.index("A")) for r, line in enumerate(rows) if "A" in line), (0, 0))
    grid = {
        "width": len(rows[0]),
        "height": len(rows),
        "resolution": resolution,
        "origin": origin,
        "data": [VALUES[letter] for line in rows for letter in line],
    }
    pose = (origin[0] + (col + 0.5) * resolution, origin[1] + (row + 0.5) * resolution)
    return grid, pose


def walled(policy="nearest_frontier", **options):
    return Planner(policy, beyond_edge="wall", **options)


CORRIDOR = "T T T T T T\nA . . . . ?\nT T T T T T"


def test_a_decision_is_in_metres():
    grid, pose = drawn(CORRIDOR, resolution=2.0, origin=(-10.0, 4.0))
    decision = walled(lidar_range=5.0).plan(grid, pose)
    assert decision.status is PlannerStatus.EXPLORING and decision.action == 5
    assert decision.waypoint == (-7.0, 7.0) and decision.goal == (-1.0, 7.0)
    assert decision.path == ((-7.0, 7.0), (-5.0, 7.0), (-3.0, 7.0), (-1.0, 7.0))
    assert "going to (-1, 7), 4 steps away" in decision.reason


def test_a_grid_may_be_turned():
    grid, _ = drawn(CORRIDOR)
    grid["origin"] = (0.0, 0.0, np.pi / 2)  # its columns run along y, its rows against x
    decision = walled().plan(grid, (-1.5, 0.5))
    assert decision.waypoint == pytest.approx((-1.5, 1.5))


@pytest.mark.parametrize(
    ("text", "status", "words"),
    [
        ("A . .\n. . .", "covered", "no known free cell"),
        ("A . T ?\n. . T .", "no_reachable_frontier", "cannot be reached"),
        ("? ?\n? ?", "waiting_for_map", "no cell of the map is known"),
        ("A ? .", "waiting_for_map", "beside the robot"),
    ],
)
def test_what_keeps_the_robot_from_exploring_is_said(text, status, words):
    decision = walled().plan(*drawn(text))
    assert decision.status == status and words in decision.reason
    assert decision.waypoint is None and decision.action == 0


BAD = [
    ({"width": 3}, "malformed_map", "width=3 times height=1 is 3"),
    ({"width": -1}, "malformed_map", "width=-1"),
    ({"width": True}, "malformed_map", "width=True"),
    ({"width": 10**9, "height": 10**9}, "malformed_map", "at most"),
    ({"resolution": 0}, "malformed_map", "resolution=0.0"),
    ({"resolution": float("nan")}, "malformed_map", "resolution=nan"),
    ({"resolution": 0.01}, "malformed_map", "set cell_size"),
    ({"origin": [0]}, "malformed_map", "origin has 1"),
    ({"origin": [0, None]}, "malformed_map", "origin[1]=None"),
    ({"data": [0, 101]}, "malformed_map", "data holds 101"),
    ({"data": [0, 0.5]}, "malformed_map", "whole numbers"),
    ({"data": "xy"}, "malformed_map", "data has 1 values"),
    ({"width": 0, "data": []}, "waiting_for_map", "no cell"),
]


@pytest.mark.parametrize(("change", "status", "words"), BAD, ids=str)
def test_a_grid_that_is_none_is_a_status_that_names_the_field(change, status, words):
    grid, pose = drawn("A .")
    decision = walled().plan(grid | change, pose)
    assert decision.status == status and words in decision.reason and decision.waypoint is None


@pytest.mark.parametrize("pose", [None, (1,), (0.5, float("nan")), "ab", (0.5, "x"), 3, {}])
def test_a_pose_that_is_none_is_a_status(pose):
    assert walled().plan(drawn("A .")[0], pose).status is PlannerStatus.MALFORMED_POSE


def test_a_robot_off_the_map_or_outside_its_polygon_is_told_so():
    grid, _ = drawn("A . .")
    assert walled().plan(grid, (3.5, 0.5)).status is PlannerStatus.OUTSIDE_MAP
    assert walled().plan(grid, (1e300, 0.5)).status is PlannerStatus.MALFORMED_POSE
    polygon = [(1, -1), (3, -1), (3, 2), (1, 2)]
    decision = walled(polygon=polygon).plan(grid, (0.5, 0.5))
    assert decision.status is PlannerStatus.OUTSIDE_MAP and "polygon" in decision.reason


@pytest.mark.parametrize("polygon", [[], [(0, 0), (1, 1)], [(0, 0), (1, 1), (2, 2)], [(0, 0)] * 9])
def test_a_polygon_without_an_area_is_refused(polygon):
    with pytest.raises(ValueError, match="polygon="):
        walled(polygon=polygon)


def test_the_robot_stays_inside_its_polygon():
    grid, pose = drawn(". . . A . . ?")
    polygon = [(-1, -1), (5, -1), (5, 2), (-1, 2)]
    assert walled().plan(grid, pose).status is PlannerStatus.EXPLORING
    assert walled(polygon=polygon).plan(grid, pose).status is PlannerStatus.COVERED


def test_the_robot_keeps_its_radius_and_leaves_an_obstacle():
    grid, pose = drawn(". . . ?\nA . . ?\nT . . ?\n. . . ?")
    assert walled().plan(grid, pose).status is PlannerStatus.EXPLORING
    decision = walled(robot_radius=0.8).plan(grid, pose)
    assert decision.status is PlannerStatus.IN_OBSTACLE and "too close" in decision.reason
    assert decision.waypoint == (0.5, 0.5) and decision.path[-1] == decision.goal
    boxed = walled().plan(*drawn("T T T\nT T T")[:1], (0.5, 0.5))
    assert boxed.status is PlannerStatus.IN_OBSTACLE and boxed.waypoint is None
    assert "no known free way" in boxed.reason


def test_a_cell_that_the_last_scan_has_hit_is_not_entered():
    grid, pose = drawn(CORRIDOR)
    assert walled().plan(grid, pose, scan=[(1.5, 1.5)]).waypoint is None
    assert walled().plan(grid, pose, scan=[(np.inf, 0), (np.nan, 1.5)]).waypoint == (1.5, 1.5)


def test_a_cell_that_turns_occupied_is_respected_at_once():
    planner, (grid, pose) = walled("path_gain"), drawn(CORRIDOR)
    assert planner.plan(grid, pose).waypoint == (1.5, 1.5)
    grid["data"][7] = 100
    assert planner.plan(grid, pose).waypoint is None


def test_the_same_map_and_cell_have_the_same_answer_however_often_one_asks():
    planner, (grid, pose) = walled(), drawn(CORRIDOR)
    answers = {planner.plan(grid, pose) for _ in range(20)}
    assert len(answers) == 1 and answers.pop().status is PlannerStatus.EXPLORING


def test_specks_are_not_gone_to():
    grid, pose = drawn("A . . . .\n. . . ? .\n. . . . .")
    assert walled().plan(grid, pose).status is PlannerStatus.EXPLORING
    assert walled(min_frontier_cells=2).plan(grid, pose).status is PlannerStatus.COVERED


def test_a_rejected_goal_is_set_aside_and_tried_again_later_each_time_later():
    planner, (grid, pose) = walled(retry_after=10.0), drawn(CORRIDOR)
    goal = planner.plan(grid, pose, time=0.0).goal
    assert planner.reject(time=0.0) == goal
    waiting = planner.plan(grid, pose, time=9.0)
    assert waiting.status is PlannerStatus.NO_REACHABLE_FRONTIER
    assert "set aside (1 goal), for 1 s still" in waiting.reason
    assert planner.plan(grid, pose, time=11.0).goal == goal
    planner.reject(goal, time=11.0)
    assert planner.plan(grid, pose, time=30.0).goal is None
    assert planner.plan(grid, pose, time=32.0).goal == goal


def test_a_robot_that_does_not_move_is_stuck_and_its_goal_is_set_aside():
    planner, (grid, pose) = walled(stuck_after=5.0), drawn(CORRIDOR)
    assert planner.plan(grid, pose, time=0.0).status is PlannerStatus.EXPLORING
    assert planner.plan(grid, pose, time=4.0).status is PlannerStatus.EXPLORING
    stuck = planner.plan(grid, pose, time=5.0)
    assert stuck.status is PlannerStatus.STUCK and "5 s" in stuck.reason
    assert planner.plan(grid, pose, time=6.0).status is PlannerStatus.NO_REACHABLE_FRONTIER


def test_stop_and_resume():
    planner, (grid, pose) = walled(), drawn(CORRIDOR)
    planner.stop()
    assert planner.plan(grid, pose).status is PlannerStatus.STOPPED
    planner.resume()
    assert planner.plan(grid, pose).status is PlannerStatus.EXPLORING


@pytest.mark.parametrize("policy", ["nearest_frontier", "path_gain", "paper"])
def test_a_map_that_grows_and_shifts_leaves_places_where_they_are(policy):
    """The same cells in a larger grid with another origin, where beyond the edge is unknown too."""
    small, pose = drawn(". . . .\n. A . .\n. . . .", origin=(3.0, -2.0))
    large = np.full((13, 14), -1)
    large[5:8, 5:9] = 0
    grown = small | {"width": 14, "height": 13, "origin": (-2.0, -7.0), "data": large.ravel()}
    options = {"lidar_range": 5.0, "deterministic": True}
    first = Planner(policy, **options).plan(small, pose)
    assert Planner(policy, **(options | {"beyond_edge": "wall"})).plan(grown, pose) == first
    both = Planner(policy, **options)
    both.plan(small, pose)
    assert both.plan(grown, pose).status is PlannerStatus.EXPLORING


def explore(planner, steps, seen=None, at=(10, 10)):
    """Walks in a hall of 21 x 21 cells with a view of 3; gives the decisions and where it ended."""
    seen = np.full((21, 21), -1) if seen is None else seen
    decisions = []
    for _ in range(steps):
        row, col = at
        seen[max(row - 3, 0) : row + 4, max(col - 3, 0) : col + 4] = 0
        grid = {"width": 21, "height": 21, "resolution": 0.5, "origin": (0, 0), "data": seen}
        decisions.append(planner.plan(grid, (col / 2 + 0.25, row / 2 + 0.25), time=0.0))
        if decisions[-1].waypoint is None:
            break
        x, y = decisions[-1].waypoint
        at = int(y * 2), int(x * 2)
    return decisions, seen, at


@pytest.mark.parametrize("policy", ["nearest_frontier", "path_gain", "cost", "random", "paper"])
def test_a_state_that_was_saved_goes_on_as_if_nothing_had_been(policy):
    options = {"lidar_range": 1.5, "clock": lambda: 0.0}
    one, other = walled(policy, **options), walled(policy, **options)
    _, seen, at = explore(one, 12)
    other.restore(json.loads(json.dumps(one.state())))
    assert explore(other, 12, seen.copy(), at)[0] == explore(one, 12, seen.copy(), at)[0]


@pytest.mark.parametrize("state", [None, {}, {"policy": "path_gain"}, {"policy": "paper"}])
def test_a_state_that_is_none_is_refused(state):
    with pytest.raises(ValueError, match="state"):
        walled("path_gain").restore(state)


def test_threads_may_ask_at_once():
    planner, (grid, pose) = walled("path_gain"), drawn(CORRIDOR)
    found, threads = [], []
    for _ in range(8):
        threads.append(threading.Thread(target=lambda: found.append(planner.plan(grid, pose))))
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8 and len(set(found)) == 1


def test_an_unknown_policy_is_refused_with_the_nearest_name():
    with pytest.raises(
        ValueError, match=r"policy=path_gian is not allowed.*did you mean path_gain"
    ):
        Planner("path_gian")
    with pytest.raises(ValueError, match="free_at_most"):
        walled(free_at_most=70, occupied_at_least=65)


NUMBERS = st.one_of(st.floats(), st.integers(-10, 10), st.floats(-12, 12))
RUBBISH = st.one_of(st.none(), st.text(max_size=3), st.booleans(), NUMBERS, st.lists(NUMBERS))
PLANNERS = {
    name: Planner(name, lidar_range=3.0, robot_radius=radius, beyond_edge=edge)
    for name, radius, edge in (
        ("path_gain", 0.0, "unknown"),
        ("nearest_frontier", 0.8, "wall"),
        ("information_gain", 0.0, "unknown"),
        ("cost", 0.0, "wall"),
        ("random", 1.2, "unknown"),
    )
}


@st.composite
def grids(draw):
    """Grids, most of them right, tiny to larger, shrinking and jumping from one to the next."""
    width, height = draw(st.integers(0, 14)), draw(st.integers(0, 14))
    values = draw(st.sampled_from([[-1], [100], [0], [0, -1], [0, 0, 0, -1, 100], [-1, 30, 70, 0]]))
    chosen = np.random.default_rng(draw(st.integers(0, 999))).choice(values, width * height)
    grid = {
        "width": width,
        "height": height,
        "resolution": draw(st.sampled_from([1.0, 0.5, 0.7])),
        "origin": draw(st.sampled_from([(0, 0), (-3.0, 2.5), (0.3, 0.1, 0.5), (7, -1, 0)])),
        "data": chosen.tolist(),
    }
    if draw(st.integers(0, 3)) == 0:
        grid[draw(st.sampled_from([*grid]))] = draw(RUBBISH)
    return grid


def occupancy(grid, x, y):
    """The value of a grid at a point, by its definition."""
    ox, oy, yaw = (*grid["origin"], 0.0)[:3]
    dx, dy = x - ox, y - oy
    col = (np.cos(yaw) * dx + np.sin(yaw) * dy) / grid["resolution"]
    row = (np.cos(yaw) * dy - np.sin(yaw) * dx) / grid["resolution"]
    assert 0 <= row < grid["height"] and 0 <= col < grid["width"]
    return grid["data"][int(row) * grid["width"] + int(col)]


@settings(max_examples=2000, deadline=None)
@given(
    st.sampled_from([*PLANNERS]),
    st.one_of(grids(), RUBBISH),
    st.one_of(st.tuples(st.floats(-2, 9), st.floats(-2, 9)), RUBBISH),
    st.one_of(st.none(), st.lists(st.tuples(NUMBERS, NUMBERS), max_size=3), RUBBISH),
)
def test_whatever_comes_has_a_status_and_no_waypoint_that_is_not_free(name, grid, pose, scan):
    decision = PLANNERS[name].plan(grid, pose, scan=scan)
    assert isinstance(decision.status, PlannerStatus) and decision.reason
    assert decision.waypoint is None or decision.status in ("exploring", "in_obstacle")
    if decision.waypoint is not None:
        x, y = decision.waypoint
        near = np.hypot(x - pose[0], y - pose[1]) <= 2.13 * grid["resolution"]
        own = decision.action == 0
        assert near and (own or 0 <= occupancy(grid, x, y) <= 25)
