"""The planner's answer: what the robot is to do, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

Point = tuple[float, float]
"""(x, y) in the frame of the map, metres."""


class PlannerStatus(StrEnum):
    """What a planner is doing, or what keeps it from exploring."""

    EXPLORING = "exploring"
    """There is something left, and a way to it."""
    COVERED = "covered"
    """No known free cell has an unknown neighbour: nothing is left."""
    NO_REACHABLE_FRONTIER = "no_reachable_frontier"
    """There is something left, but no known way to it."""
    WAITING_FOR_MAP = "waiting_for_map"
    """There is no map yet, or it does not show what is beside the robot."""
    STUCK = "stuck"
    """The robot goes round, or does not come from the spot."""
    IN_OBSTACLE = "in_obstacle"
    """The robot's own cell is occupied or too close to what is; the waypoint leads out of it."""
    OUTSIDE_MAP = "outside_map"
    """The robot is not on the map, or outside the polygon that it is to stay in."""
    MALFORMED_MAP = "malformed_map"
    """The map is none."""
    MALFORMED_POSE = "malformed_pose"
    """The pose is none, or the last scan is no list of points."""
    STOPPED = "stopped"
    """The planner was told to stop."""


@dataclass(frozen=True)
class Decision:
    """What the robot is to do, and why; places are in metres."""

    status: PlannerStatus
    """What the planner is doing."""
    reason: str
    """The same in words, with what it is that keeps the planner from exploring."""
    waypoint: Point | None = None
    """The centre of the cell to go to next: the robot's own or one beside it, known to be free."""
    action: int = 0
    """That as an action of Table I, rows counted along y; 0: stay."""
    proposed: int = 0
    """The policy's own action; another one if the safety filter stepped in."""
    goal: Point | None = None
    """The viewpoint that the policy is heading for; None for a policy that has none."""
    path: tuple[Point, ...] = ()
    """A shortest known way to the goal that begins with the waypoint; else the waypoint alone."""
    probabilities: tuple[float, ...] | None = None
    """Of the nine actions; None for a policy without them."""

    @staticmethod
    def from_text(text: Mapping[str, Any]) -> Decision:
        """Reads what ``dataclasses.asdict`` gives, after a way through JSON."""
        known = dict(text, status=PlannerStatus(text["status"]))
        for name in ("waypoint", "goal", "probabilities"):
            known[name] = known[name] and tuple(known[name])
        known["path"] = tuple((x, y) for x, y in known["path"])
        return Decision(**known)

    @property
    def intervened(self) -> bool:
        """Whether the safety filter replaced the policy's action."""
        return self.action != self.proposed
