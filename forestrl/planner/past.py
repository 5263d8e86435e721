"""What a planner remembers from call to call, and that as text."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import torch

from forestrl.planner.cells import CellPlanner
from forestrl.planner.decision import Decision, Point
from forestrl.planner.layout import Layout
from forestrl.planner.memory import as_text, carried_over, from_text
from forestrl.planner.policies import MakePolicy
from forestrl.planner.set_aside import SetAside
from forestrl.planner.situation import Situation

_FORMAT = 1


class Past:
    """What was so far.

    Args:
        seed: of a policy that samples.
        wait: seconds until a goal that was set aside is tried again for the first time.
    """

    def __init__(self, seed: int, wait: float) -> None:
        self.active = True
        """Whether the planner is not stopped."""
        self.generator = torch.Generator().manual_seed(seed)
        """Of a policy that samples."""
        self.cells: CellPlanner | None = None
        """Decides on cells; None before the first map."""
        self.lidar_range = math.nan
        """What that was made for, cells."""
        self.layout: Layout | None = None
        """Of the last map."""
        self.visited: dict[Point, None] = {}
        """Where the robot was, in order."""
        self.aside = SetAside(wait)
        """The goals that were rejected."""
        self.last: tuple[str, Decision] | None = None
        """A digest of the situation that was decided in last, and the decision."""
        self.spot: tuple[Point, float] | None = None
        """The spot that the robot has not left, and since when, seconds."""
        self.round_since: float | None = None
        """Since when the policy goes round, seconds."""

    def taken_up(self, here: Situation, make: MakePolicy) -> CellPlanner:
        """Gives what decides on cells, with what it may still remember on this map.

        Args:
            here: the situation.
            make: makes the policy.
        """
        if self.cells is None or self.lidar_range != here.lidar_range:
            self.cells = CellPlanner(*make(here.lidar_range), self.generator)
        elif self.layout != here.layout:
            self.cells.state = carried_over(self.cells.state)
        self.layout, self.lidar_range = here.layout, here.lidar_range
        return self.cells

    def last_goal(self) -> Point | None:
        """Gives what the last decision was heading for."""
        return self.last and (self.last[1].goal or self.last[1].waypoint)

    def on_the_spot_for(self, at: Point, reach: float, now: float) -> float:
        """Tells for how long the robot has not left its spot, seconds; 0 if it has.

        Args:
            at: where it is, metres.
            reach: how far the spot reaches, metres.
            now: seconds.
        """
        left = self.spot is None or math.dist(at, self.spot[0]) >= reach
        return 0.0 if left or self.spot is None else max(now - self.spot[1], 0.0)

    def as_text(self, now: float) -> dict[str, Any]:
        """Gives all of it as JSON can hold it; times are counted from now."""
        spot = self.spot and [list(self.spot[0]), now - self.spot[1]]
        return {
            "format": _FORMAT,
            "active": self.active,
            "generator": self.generator.get_state().tolist(),
            "layout": self.layout and asdict(self.layout),
            "lidar_range": None if self.layout is None else self.lidar_range,
            "memory": {} if self.cells is None else as_text(self.cells.state),
            "visited": [list(point) for point in self.visited],
            "set_aside": self.aside.state(now),
            "last": self.last and [self.last[0], asdict(self.last[1])],
            "spot": spot,
            "round_for": None if self.round_since is None else now - self.round_since,
        }

    @staticmethod
    def from_text(text: Mapping[str, Any], make: MakePolicy, wait: float, now: float) -> Past:
        """Takes up what :meth:`Past.as_text` gave.

        Args:
            text: what it gave.
            make: makes the policy.
            wait: as in the constructor.
            now: seconds.

        Raises:
            ValueError: if it is none.
        """
        if text.get("format") != _FORMAT:
            raise ValueError(f"this is no planner's state of format {_FORMAT}")
        past = Past(0, wait)
        try:
            past._take_up(text, make, now)
        except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
            raise ValueError(f"this planner's state is damaged: {error!r}") from error
        return past

    def _take_up(self, text: Mapping[str, Any], make: MakePolicy, now: float) -> None:
        self.active = bool(text["active"])
        self.generator.set_state(torch.tensor(text["generator"], dtype=torch.uint8))
        if text["layout"] is not None:
            self.layout = Layout.from_text(text["layout"])
            self.lidar_range = float(text["lidar_range"])
            self.cells = CellPlanner(*make(self.lidar_range), self.generator)
            self.cells.state = from_text(text["memory"])
        self.visited = {(x, y): None for x, y in text["visited"]}
        self.aside.restore(text["set_aside"], now)
        if text["last"] is not None:
            self.last = text["last"][0], Decision.from_text(text["last"][1])
        if text["spot"] is not None:
            (x, y), past = text["spot"]
            self.spot = (x, y), now - past
        if text["round_for"] is not None:
            self.round_since = now - text["round_for"]
