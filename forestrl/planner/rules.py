"""The rules that a planner makes of a map by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from forestrl.planner.grid import BadInputError, numbers_of
from forestrl.settings import not_allowed

Edge = Literal["unknown", "wall"]
_MOST_CORNERS = 10_000


@dataclass(frozen=True, kw_only=True)
class Rules:
    """What a planner makes of a map; lengths in metres. See :class:`forestrl.planner.Planner`."""

    lidar_range: float
    robot_radius: float
    cell_size: float | None
    free_at_most: int
    occupied_at_least: int
    min_frontier_cells: int
    beyond_edge: Edge
    reject_radius: float | None
    polygon: np.ndarray | None
    """Corners (x, y), float64 ``[m, 2]``."""

    def around_rejected(self, side: float) -> float:
        """Gives how far around a rejected goal nothing is gone to, by the side of a cell."""
        return 2 * side if self.reject_radius is None else self.reject_radius


def corners(polygon: Any) -> np.ndarray | None:
    """Reads a polygon.

    Args:
        polygon: its corners in order, (x, y); None for no polygon.

    Returns:
        float64 ``[m, 2]``, or None.

    Raises:
        ValueError: if it is none, has too few or too many corners, or spans no area.
    """
    if polygon is None:
        return None
    if not isinstance(polygon, list | tuple | np.ndarray) or not 3 <= len(polygon) <= _MOST_CORNERS:
        reason = f"it must be a list of 3 to {_MOST_CORNERS} corners (x, y), or null for none"
        raise not_allowed("polygon", str(polygon)[:60], reason)
    try:
        found = np.array([numbers_of("corner", corner, (2,)) for corner in polygon])
    except BadInputError as error:
        raise not_allowed("polygon", str(polygon)[:60], str(error)) from error
    x, y = (found - found.mean(0)).T
    if abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) < 1e-12:
        raise not_allowed("polygon", str(polygon)[:60], "it spans no area")
    return found
