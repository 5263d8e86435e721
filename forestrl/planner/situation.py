"""What a robot sees, on cells: from a grid, a pose and the rules it plans by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from forestrl.functional import Cell
from forestrl.planner.decision import Decision, PlannerStatus, Point
from forestrl.planner.grid import BadInputError, Grid, numbers_of, points_of
from forestrl.planner.layout import Layout, Place, fine_layout, laid_out
from forestrl.planner.masks import (
    cells_of,
    in_polygon,
    inflate,
    seal_around,
    seal_beside,
    seal_specks,
)
from forestrl.planner.rules import Rules

MOST_CELLS_OF_RANGE = 40


@dataclass(frozen=True)
class Situation:
    """Where the robot is on the map that it plans on."""

    bare: np.ndarray
    """The map as it was seen, ``Cell`` values, uint8 ``[H, W]``."""
    cells: np.ndarray
    """The map for planning: what the robot must not or need not go to is occupied."""
    layout: Layout
    """Of both."""
    place: Place
    """The robot's cell."""
    lidar_range: float
    """Cells."""
    edge: int
    """Rows and columns of unknown cells that were put around the map."""

    @property
    def in_obstacle(self) -> bool:
        """Whether the robot's own cell is none that it may be in."""
        return self.cells[self.place] != Cell.FREE

    def sees_all_beside(self) -> bool:
        """Tells whether no cell beside the robot is unknown, of those that are on the map."""
        (row, col), least = self.place, self.edge
        last_row, last_col = (size - least for size in self.bare.shape)
        around = self.bare[
            max(row - 1, least) : min(row + 2, last_row),
            max(col - 1, least) : min(col + 2, last_col),
        ]
        return bool((around != Cell.UNKNOWN).all())


def situation(
    grid: Any, pose: Any, scan: Any, rules: Rules, visited: Sequence[Point], aside: np.ndarray
) -> Situation | Decision:
    """Puts together what the robot sees.

    Args:
        grid: as :meth:`Grid.of` takes it; None if there is none yet.
        pose: (x, y) or (x, y, yaw).
        scan: points where the sensor has hit something just now, (x, y) ``[n, 2]``; or None.
        rules: of the planner.
        visited: where the robot has been, (x, y).
        aside: goals that are set aside, (x, y), float64 ``[n, 2]``.

    Returns:
        the situation; or a decision, where there is none to plan in.
    """
    if grid is None:
        return Decision(PlannerStatus.WAITING_FOR_MAP, "there is no map yet")
    try:
        read = Grid.of(grid)
        fine = fine_layout(read)
        factor = _joined(read.resolution, rules)
    except BadInputError as error:
        return Decision(PlannerStatus.MALFORMED_MAP, str(error))
    try:
        at = numbers_of("pose", pose, (2, 3))
        hits = points_of("scan", [] if scan is None else scan)
    except BadInputError as error:
        return Decision(PlannerStatus.MALFORMED_POSE, str(error))
    cells = cells_of(read.data, rules.free_at_most, rules.occupied_at_least)
    if not (cells != Cell.UNKNOWN).any():
        return Decision(PlannerStatus.WAITING_FOR_MAP, "no cell of the map is known yet")
    own = fine.place(at[0], at[1])
    if own is None:
        x, y = at[0], at[1]
        return Decision(PlannerStatus.OUTSIDE_MAP, f"the robot at ({x:.6g}, {y:.6g}) is not on it")
    _mark(cells, fine, own, hits)
    lidar_range = rules.lidar_range / (read.resolution * factor)
    edge = int(np.ceil(lidar_range)) if rules.beyond_edge == "unknown" else 0
    bare, layout = laid_out(cells, fine, factor, edge)
    place = layout.place(at[0], at[1])
    if place is None:  # by rounding, at the very edge
        return Decision(PlannerStatus.OUTSIDE_MAP, "the robot is at the very edge of the map")
    planned = bare.copy()
    if rules.robot_radius > read.resolution / 2:
        grown = inflate(cells, rules.robot_radius / read.resolution)
        planned, _ = laid_out(grown, fine, factor, edge)
    if rules.polygon is not None:
        if not in_polygon(np.array([at[:2]]), rules.polygon)[0]:
            return Decision(PlannerStatus.OUTSIDE_MAP, "the robot is outside the polygon")
        outside = ~in_polygon(layout.centres(), rules.polygon).reshape(layout.shape)
        outside[place] = False
        planned[outside] = Cell.OCCUPIED
    _seal(planned, layout, place, rules, visited, aside)
    return Situation(bare, planned, layout, place, lidar_range, edge)


def _joined(resolution: float, rules: Rules) -> int:
    """Tells how many cells of the map become one of the plan along a side."""
    size = rules.cell_size
    factor = 1 if size is None else max(1, round(size / resolution))
    side = resolution * factor
    reach = rules.lidar_range / side
    if not 1.415 <= reach <= MOST_CELLS_OF_RANGE:
        raise BadInputError(
            f"cells of {side:.6g} m make lidar_range={rules.lidar_range} {reach:.4g} cells: they "
            f"must be 1.415 to {MOST_CELLS_OF_RANGE}; set cell_size"
        )
    return factor


def _mark(cells: np.ndarray, fine: Layout, own: Place, hits: np.ndarray) -> None:
    """Marks what the last scan has hit, and that the robot's own cell is not unknown."""
    found = fine.places(hits)
    cells[found[:, 0], found[:, 1]] = Cell.OCCUPIED
    if cells[own] == Cell.UNKNOWN:
        cells[own] = Cell.FREE


def _seal(
    planned: np.ndarray,
    layout: Layout,
    place: Place,
    rules: Rules,
    visited: Sequence[Point],
    aside: np.ndarray,
) -> None:
    """Occupies what is not worth going to, or is not to be gone to now."""
    been = layout.places(np.array(visited).reshape(-1, 2))
    seal_beside(planned, np.concatenate((been, [place])))
    if len(aside):
        radius = rules.around_rejected(layout.side) / layout.side
        seal_around(planned, layout.places(aside), radius, *place)
    if rules.min_frontier_cells > 1:
        seal_specks(planned, rules.min_frontier_cells)
