"""A recording: an episode as plain data."""

import numpy as np
import pytest

from forestrl import functional as F
from forestrl.evaluation import arenas
from forestrl.planners import NearestFrontier, PathGain
from forestrl.rendering import play
from tests.evaluation.policies import forest
from tests.pages import episodes

NAMES = ("path_gain", "nearest_frontier", "network", "random")


def scenes(policy, steps=episodes.STEPS):
    env = forest(1, size=24, n_trees=14)
    td, draws = arenas.draw_arenas(env, 0, [1]), arenas.uniforms(0, [1], steps)
    return list(play(env, policy, td, steps=steps, uniforms=draws))


def test_a_recording_has_the_map_the_robot_had_at_every_step():
    recording, played = episodes.of("nearest_frontier"), scenes(NearestFrontier())
    assert recording.steps == len(played) - 1 > 10
    for step, scene in enumerate(played):
        assert (recording.map_at(step) == scene.cells).all()
        assert recording.moments[step].agent == scene.agent
        assert recording.coverage[step] == scene.coverage


@pytest.mark.parametrize("name", NAMES)
def test_what_became_known_agrees_with_the_truth_and_is_said_once(name):
    recording = episodes.of(name)
    seen = np.concatenate([moment.changed for moment in recording.moments])
    assert len(seen) == len(set(seen.tolist()))
    cells = recording.map_at(recording.steps)
    known = cells != F.Cell.UNKNOWN
    assert (recording.trees == (cells == F.Cell.OCCUPIED))[known].all()


def test_watching_a_planner_does_not_change_what_it_does():
    played, recording = scenes(PathGain(lidar_range=5.0)), episodes.of("path_gain")
    assert [moment.agent for moment in recording.moments] == [scene.agent for scene in played]


def test_the_viewpoints_of_a_planner_are_the_best_first_and_its_way_begins_where_it_goes():
    moments = episodes.of("path_gain").moments[:-1]
    assert sum(len(moment.considered.way) > 0 for moment in moments) > 10
    for moment in moments:
        cells, scores, way = moment.considered
        assert list(scores) == sorted(scores, reverse=True) and len(cells) == len(scores)
        if way:
            (down, right), (row, col) = F.DISPLACEMENTS[moment.proposed].tolist(), moment.agent
            assert way[0] == (row + down, col + right)
            assert way[-1] == cells[0]


def test_where_the_filter_stepped_in_what_was_proposed_is_not_feasible():
    moments = episodes.of("random").moments[:-1]
    replaced = [moment for moment in moments if moment.proposed != moment.executed]
    assert len(replaced) > 3
    assert not any(moment.feasible[moment.proposed] for moment in replaced)
    assert all(moment.feasible[moment.executed] for moment in moments)


def test_only_a_policy_that_weighs_its_actions_shows_the_graph():
    assert episodes.of("network").has_graph and not episodes.of("nearest_frontier").has_graph
    for step, moment in enumerate(episodes.of("network").moments[:-1]):
        cells = episodes.of("network").map_at(step)
        unknown = np.pad(cells == F.Cell.UNKNOWN, 1)
        near = sum(
            unknown[i : i + cells.shape[0], j : j + cells.shape[1]] * 1
            for i in range(3)
            for j in range(3)
        )
        assert len(moment.waypoints) == ((cells == F.Cell.FREE) & (near > 0)).sum()
        assert sum(moment.probability) == pytest.approx(1)
