"""The planner of a robot: from occupancy grid and pose to the next waypoint, and why."""

from __future__ import annotations

import hashlib
import time as clocks
from collections.abc import Callable, Mapping, Sequence
from threading import RLock
from typing import Annotated, Any

import numpy as np
import torch

from forestrl.planner.answering import answer, leave_obstacle, with_some_aside
from forestrl.planner.cells import CellPlanner
from forestrl.planner.decision import Decision, PlannerStatus, Point
from forestrl.planner.grid import BadInputError, finite, numbers_of
from forestrl.planner.memory import carried_over, keep_views
from forestrl.planner.past import Past
from forestrl.planner.policies import policy_named
from forestrl.planner.rules import Edge, Rules, corners
from forestrl.planner.situation import Situation, situation
from forestrl.planners.viewpoints.path_gain import GRID
from forestrl.settings import Range, checked, not_allowed

Metres = Annotated[float, Range(above=0, high=1e6)]
Seconds = Annotated[float, Range(above=0, high=1e9)]
PerCent = Annotated[int, Range(0, 100)]
Corners = Sequence[Sequence[float]]


class Planner:
    """Tells one robot where to go next: grid and pose in, waypoint and status out.

    The planner is asked as often as one likes, say at every new map: as long as map and cell are
    the same, so is the answer. It may be asked from several threads. Bad input is a status.

    Args:
        policy: a classical planner by name, a released policy (``learned``, ``linear``,
            ``paper``), a policy file or run folder; or a function that makes one.
        lidar_range: of the robot's sensor, metres.
        robot_radius: free cells whose centre is nearer than this to an occupied cell are not gone
            to, metres; 0 for none.
        cell_size: side of the cells to plan on, metres; a whole number of the map's own cells is
            joined. None for the map's own cells.
        free_at_most: occupancy up to which a cell is free, per cent.
        occupied_at_least: occupancy from which it is occupied; between the two it is unknown.
        min_frontier_cells: unknown cells beside free ones that hang together with fewer than this
            are not gone to: the specks that a SLAM leaves.
        beyond_edge: what lies beyond the edge of the grid: unknown cells, as around a map that
            grows, or a wall.
        polygon: the corners (x, y) of what the robot is to stay in, metres; None for all.
        reject_radius: how far around a goal that was rejected nothing is gone to, metres; None for
            twice the side of a cell.
        retry_after: a goal that was rejected, or a policy that goes round, is tried again after
            this, seconds; each time it fails again the wait is twice as long.
        stuck_after: if the robot does not leave its spot for this long, its goal is set aside,
            seconds; None for never.
        deterministic: take the most probable action instead of a sampled one; None for what the
            policy is meant for.
        seed: of a policy that samples.
        clock: gives the time where :meth:`Planner.plan` is not given one, seconds.

    Raises:
        CheckpointError: if the policy's file is missing or none.
        ValueError: if a setting is not allowed.

    Examples:
        >>> row = {"width": 3, "height": 1, "resolution": 1.0, "origin": [0, 0], "data": [0, 0, -1]}
        >>> decision = Planner("nearest_frontier", beyond_edge="wall").plan(row, (0.5, 0.5))
        >>> decision.status.value, decision.waypoint
        ('exploring', (1.5, 0.5))
    """

    @checked
    def __init__(
        self,
        policy: str | Callable[[float], Any] = "learned",
        *,
        lidar_range: Metres = 5.0,
        robot_radius: Annotated[float, Range(0, 100)] = 0.0,
        cell_size: Metres | None = None,
        free_at_most: PerCent = 25,
        occupied_at_least: PerCent = 65,
        min_frontier_cells: Annotated[int, Range(1, 1_000_000)] = 1,
        beyond_edge: Edge = "unknown",
        polygon: Corners | None = None,
        reject_radius: Metres | None = None,
        retry_after: Seconds = 30.0,
        stuck_after: Seconds | None = None,
        deterministic: bool | None = None,
        seed: Annotated[int, Range(0, 2**63 - 1)] = 0,
        clock: Callable[[], float] = clocks.monotonic,
    ) -> None:
        if free_at_most >= occupied_at_least:
            reason = f"it must be less than occupied_at_least={occupied_at_least}"
            raise not_allowed("free_at_most", free_at_most, reason)
        self.rules = Rules(
            lidar_range=lidar_range,
            robot_radius=robot_radius,
            cell_size=cell_size,
            free_at_most=free_at_most,
            occupied_at_least=occupied_at_least,
            min_frontier_cells=min_frontier_cells,
            beyond_edge=beyond_edge,
            reject_radius=reject_radius,
            polygon=corners(polygon),
        )
        self._make = policy_named(policy, deterministic) if isinstance(policy, str) else policy
        self._name = policy if isinstance(policy, str) else "a function"
        self._retry_after, self._stuck_after = retry_after, stuck_after
        self._seed, self._clock, self._lock = seed, clock, RLock()
        self.start()

    @classmethod
    def from_release(cls, name: str = "learned", **settings: Any) -> Planner:
        """Makes a planner of a policy that comes with the package.

        Args:
            name: ``learned``, ``linear``, ``paper``, or a classical planner.
            settings: of the planner.
        """
        return cls(name, **settings)

    def start(self) -> None:
        """Begins anew: forgets where the robot was, and what was set aside."""
        with self._lock:
            self._past = Past(self._seed, self._retry_after)

    def stop(self) -> None:
        """Answers ``stopped`` from now on, and remembers all."""
        with self._lock:
            self._past.active = False

    def resume(self) -> None:
        """Goes on where it was stopped."""
        with self._lock:
            self._past.active, self._past.spot = True, None

    def plan(
        self, grid: Any, pose: Any, *, scan: Any = None, time: float | None = None
    ) -> Decision:
        """Takes the next decision.

        Args:
            grid: a mapping with ``width``, ``height``, ``resolution`` (metres), ``origin`` (x, y
                and maybe yaw) and ``data`` (-1 for unknown, else 0 to 100 per cent, row by row from
                the least y), or a :class:`~forestrl.planner.Grid`; None if there is none yet.
            pose: the robot's (x, y) or (x, y, yaw) in the frame of the map, metres.
            scan: points where the sensor has hit something just now, (x, y) ``[n, 2]`` in the frame
                of the map: they count as occupied in this call.
            time: seconds; None for the clock's.

        Returns:
            the decision; whatever the input is, a status says what is wrong with it.
        """
        with self._lock:
            if not self._past.active:
                return Decision(PlannerStatus.STOPPED, "the planner was told to stop")
            try:
                now = self._clock() if time is None else finite("time", time)
            except BadInputError as error:
                return Decision(PlannerStatus.MALFORMED_POSE, str(error))
            aside = self._past.aside.goals(now)
            here = situation(grid, pose, scan, self.rules, list(self._past.visited), aside)
            if isinstance(here, Decision):
                return here
            cells = self._past.taken_up(here, self._make)
            if here.in_obstacle:
                return leave_obstacle(here)
            return self._watched(self._decided(cells, here, now), cells, here, now)

    def reject(self, goal: Any = None, *, time: float | None = None) -> Point | None:
        """Sets a goal aside that could not be reached; it is tried again later.

        Args:
            goal: (x, y); None for the goal of the last decision.
            time: seconds; None for the clock's.

        Returns:
            the goal that was set aside; None if there was none.

        Raises:
            BadInputError: if it is none.
        """
        with self._lock:
            found = self._past.last_goal() if goal is None else numbers_of("goal", goal, (2,))
            if found is None:
                return None
            now = self._clock() if time is None else finite("time", time)
            side = 1.0 if self._past.layout is None else self._past.layout.side
            place = (found[0], found[1])
            self._past.aside.add(place, now, self.rules.around_rejected(side))
            return place

    def state(self) -> dict[str, Any]:
        """Gives all that is remembered, as JSON can hold it."""
        with self._lock:
            return {"policy": self._name, **self._past.as_text(self._clock())}

    def restore(self, state: Any) -> None:
        """Goes on from what :meth:`Planner.state` gave, in a planner with the same settings.

        Raises:
            ValueError: if it is of another policy, or none.
        """
        with self._lock:
            policy = state.get("policy") if isinstance(state, Mapping) else None
            if policy != self._name:
                raise ValueError(f"this is the state of policy={policy}, not of {self._name}")
            self._past = Past.from_text(state, self._make, self._retry_after, self._clock())

    def _decided(self, cells: CellPlanner, here: Situation, now: float) -> Decision:
        """Decides, unless the robot has not yet done what was decided last."""
        past = self._past
        situation = here.cells.tobytes() + repr((here.layout, here.place)).encode()
        digest = hashlib.blake2b(situation).hexdigest()
        if past.last is not None and past.last[0] == digest and past.last[1].action:
            return past.last[1]
        if GRID in getattr(cells.policy, "out_keys", ()):
            been = here.layout.places(np.array(list(past.visited)).reshape(-1, 2))
            keep_views(cells.state, here.cells, been, here.lidar_range)
        decision = answer(cells.decide(torch.from_numpy(here.cells), here.place), here)
        past.visited[here.layout.point(here.place)] = None
        if len(aside := past.aside.goals(now)):
            decision = with_some_aside(decision, len(aside), past.aside.next_try(now))
        past.last = digest, decision
        return decision

    def _watched(
        self, decision: Decision, cells: CellPlanner, here: Situation, now: float
    ) -> Decision:
        """Sets the goal aside of a robot that does not move, and lets a stuck policy begin anew."""
        past = self._past
        if decision.status is not PlannerStatus.STUCK:
            past.round_since = None
        elif past.round_since is None:
            past.round_since = now
        elif now - past.round_since >= self._retry_after:
            cells.state, past.round_since = carried_over(cells.state), None
        at, reach = here.layout.point(here.place), 1.5 * here.layout.side
        waited = past.on_the_spot_for(at, reach, now) if decision.action else 0.0
        if waited == 0.0:
            past.spot = at, now
        elif self._stuck_after is not None and waited >= self._stuck_after:
            past.spot = at, now
            self.reject(time=now)
            why = f"the robot has not left its spot for {waited:.0f} s: the goal is set aside"
            return Decision(PlannerStatus.STUCK, why)
        return decision
