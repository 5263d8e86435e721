"""Views of a scene: what is drawn where."""

import pytest
import torch

from forestrl import keys as K
from forestrl.rendering import panel as P
from forestrl.rendering.scene import Trail
from forestrl.rendering.views import draw_arena, draw_decision, draw_map
from tests.rendering.scenes import (
    EAST,
    NORTH_WEST,
    SCALE,
    SOUTH,
    SOUTH_WEST,
    WEST,
    acted,
    colour,
    count,
    scene,
    step,
)


def test_the_arena_shows_trunks_and_the_agent_and_the_map_what_is_known():
    arena, known = draw_arena(scene(), SCALE), draw_map(scene(), SCALE)
    assert arena.size == known.size == (9 * SCALE, 7 * SCALE)
    assert colour(arena, 3, 3) == P.TRUNK and colour(arena, 0, 0) == P.GROUND
    assert colour(arena, 5, 2) == colour(known, 5, 2) == P.AGENT
    assert colour(known, 0, 0) == P.UNKNOWN and colour(known, 3, 3) == P.OCCUPIED
    assert colour(known, 3, 1) == P.FREE and colour(known, 2, 1) == P.FRONTIER
    assert colour(known, 6, 2) == P.INFEASIBLE  # the middle of a cross
    assert colour(known, 5, 1) == P.FREE  # the middle of a circle


def test_a_veil_lies_on_what_the_agent_does_not_know():
    td = step()
    td[K.TREES][0, 0] = True  # nobody has seen it
    plain, veiled = (draw_arena(scene(td), SCALE, veiled=veil) for veil in (False, True))
    assert colour(plain, 0, 0) == P.TRUNK and colour(veiled, 0, 0) == P.VEILED
    assert colour(plain, 0, 1) == P.GROUND and colour(veiled, 0, 1) == P.UNKNOWN
    assert colour(plain, 2, 1) == P.GROUND and colour(veiled, 2, 1) == P.FRONTIER
    assert colour(plain, 3, 3) == colour(veiled, 3, 3) == P.TRUNK
    assert colour(plain, 3, 1) == colour(veiled, 3, 1) == P.GROUND


def test_the_way_and_what_happened_on_it_are_drawn():
    trail = Trail([(2, 0), (3, 0), (4, 1)], [0.1, 0.2, 0.3], [(3, 0)], [(4, 1)])
    arena = draw_arena(scene(trail=trail), SCALE)
    assert colour(arena, 2, 0) == P.AGENT
    assert colour(arena, 3, 0) == P.INTERVENTION and colour(arena, 4, 1) == P.COLLISION
    assert draw_map(scene(trail=trail), SCALE) == draw_map(scene(), SCALE)


def test_an_agent_may_have_a_colour_of_its_own():
    trail = Trail([(2, 0)], [0.1])
    arena = draw_arena(scene(trail=trail), SCALE, agent=P.FEASIBLE)
    assert colour(arena, 2, 0) == colour(arena, 5, 2) == P.FEASIBLE
    assert count(arena, P.AGENT) == 0


def test_waypoints_are_filled_as_strongly_as_the_policy_likes_them():
    logits = torch.full((9,), -20.0)
    logits[EAST], logits[WEST] = 1.0, 0.0
    known = draw_map(scene(step(logits=logits)), SCALE)
    likely, second, unlikely = (colour(known, *cell) for cell in [(5, 3), (5, 1), (4, 1)])
    assert likely[0] < second[0] < unlikely[0] == 255  # the more green, the less red


@pytest.mark.parametrize("logits", [torch.zeros(4), torch.zeros(2, 9), None])
def test_logits_of_something_else_than_the_nine_actions_are_not_drawn(logits):
    td = step() if logits is None else step(logits=logits)
    assert draw_decision(scene(td)) == draw_decision(scene())


def decision_border(td, action):
    """The colour of the border of a cell in the decision: 48 pixels a cell."""
    row, col = {SOUTH: (2, 1), SOUTH_WEST: (2, 0), EAST: (1, 2), NORTH_WEST: (0, 0)}[action]
    return draw_decision(scene(td)).getpixel((col * 48 + 1, row * 48 + 24))


def test_the_decision_shows_what_is_executed_and_what_it_replaces():
    assert decision_border(acted(EAST), EAST) == P.AGENT
    assert decision_border(acted(EAST), NORTH_WEST) not in (P.AGENT, P.INTERVENTION)
    filtered = acted(SOUTH, executed=SOUTH_WEST)
    assert decision_border(filtered, SOUTH_WEST) == P.AGENT
    assert decision_border(filtered, SOUTH) == P.INTERVENTION
    assert count(draw_decision(scene(acted(SOUTH))), P.COLLISION) > count(
        draw_decision(scene(filtered)), P.COLLISION
    )


def test_graph_edges_are_those_of_the_observation():
    waypoint = torch.tensor([NORTH_WEST, NORTH_WEST, EAST, 0])
    graph = {K.WAYPOINT: waypoint, K.FRONTIERS: torch.tensor([3])}
    assert scene().ties == [] and count(draw_map(scene(), SCALE), P.EDGE) == 0
    tied = scene(step().update(graph))
    nearest = [(2, 2), (2, 1), (2, 3)]  # of the frontier, from (5, 2)
    assert tied.ties == list(zip(nearest, [(4, 1), (4, 1), (5, 3)], strict=True))
    assert count(draw_map(tied, SCALE), P.EDGE) > 50
