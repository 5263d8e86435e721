"""From a step on cells to an answer in metres, with its reason in words."""

from __future__ import annotations

from dataclasses import replace

import torch

from forestrl import functional as F
from forestrl import kernels
from forestrl.planner.cells import Step
from forestrl.planner.decision import Decision, PlannerStatus, Point
from forestrl.planner.situation import Situation
from forestrl.planner.ways import way, way_out
from forestrl.status import Status

_STAYS = {
    Status.COVERED: (
        PlannerStatus.COVERED,
        "no known free cell has an unknown neighbour",
    ),
    Status.NO_REACHABLE_FRONTIER: (
        PlannerStatus.NO_REACHABLE_FRONTIER,
        "what is left to see cannot be reached through known free cells",
    ),
    Status.CYCLE: (
        PlannerStatus.STUCK,
        "place and map repeat: the policy would go round for ever",
    ),
    Status.AT_GOAL: (
        PlannerStatus.STUCK,
        "the policy's goal is the robot's own cell",
    ),
    Status.GOAL_NOT_FREE: (
        PlannerStatus.STUCK,
        "the policy's goal is not free",
    ),
}


def answer(step: Step, here: Situation) -> Decision:
    """Says in metres and words what a step means.

    Args:
        step: the policy's, guarded by the filter on the map for planning.
        here: the situation it was taken in.
    """
    status = _left(here) if step.status is None else step.status
    if status != Status.EXPLORING:
        kind, reason = _STAYS[status]
        if kind is not PlannerStatus.STUCK and not here.sees_all_beside():
            kind = PlannerStatus.WAITING_FOR_MAP
            reason = (
                "the map does not show all cells beside the robot yet, and nothing else is left"
            )
        return Decision(kind, reason, proposed=step.proposed, probabilities=step.probabilities)
    layout = here.layout
    down, along = F.DISPLACEMENTS[step.action].tolist()
    target = here.place[0] + down, here.place[1] + along
    waypoint = layout.point(target)
    goal: Point | None = None
    path: tuple[Point, ...] = (waypoint,)
    if step.goal is not None:
        places = way(here.cells, target, step.goal)
        goal, path = layout.point(step.goal), tuple(layout.points(places)) or path
    return Decision(
        PlannerStatus.EXPLORING,
        _heading_for(goal, len(path)) if step.action else "the policy stays for this step",
        waypoint,
        step.action,
        step.proposed,
        goal,
        path,
        step.probabilities,
    )


def _heading_for(goal: tuple[float, float] | None, steps: int) -> str:
    if goal is None:
        return "taking a step"
    return f"going to ({goal[0]:.6g}, {goal[1]:.6g}), {steps} step{'s' * (steps > 1)} away"


def _left(here: Situation) -> Status:
    """Tells whether anything is left, for a policy that does not say."""
    cells = torch.from_numpy(here.cells)
    frontier = F.frontier(cells)
    if not frontier.any():
        return Status.COVERED
    lengths = kernels.path_lengths(cells == F.Cell.FREE, torch.tensor(here.place))
    reachable = (lengths.isfinite() & frontier).any()
    return Status.EXPLORING if reachable else Status.NO_REACHABLE_FRONTIER


def with_some_aside(decision: Decision, goals: int, wait: float) -> Decision:
    """Says of a decision that nothing is left that some of it was set aside.

    Args:
        decision: any.
        goals: how many are set aside.
        wait: seconds until the first is tried again.
    """
    if decision.status not in (PlannerStatus.COVERED, PlannerStatus.NO_REACHABLE_FRONTIER):
        return decision
    said = f"what is left was set aside ({goals} goal{'s' * (goals > 1)}), for {wait:.0f} s still"
    return replace(decision, status=PlannerStatus.NO_REACHABLE_FRONTIER, reason=said)


def leave_obstacle(here: Situation) -> Decision:
    """Says how the robot comes out of a cell that it must not be in."""
    x, y = here.layout.point(here.place)
    occupied = here.bare[here.place] == F.Cell.OCCUPIED
    what = "occupied" if occupied else "too close to an obstacle"
    said = f"the robot's cell at ({x:.6g}, {y:.6g}) is {what}"
    places = way_out(here.bare, here.cells, here.place)
    if len(places) == 0:
        return Decision(PlannerStatus.IN_OBSTACLE, f"{said}, and no known free way leads out of it")
    row, col = (int(places[0, i]) - here.place[i] for i in range(2))
    action = F.DISPLACEMENTS.tolist().index([row, col])
    path = tuple(here.layout.points(places))
    return Decision(
        PlannerStatus.IN_OBSTACLE,
        f"{said}: leaving it for ({path[-1][0]:.6g}, {path[-1][1]:.6g})",
        path[0],
        action,
        action,
        path[-1],
        path,
    )
