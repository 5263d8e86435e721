"""What a planner looked at before it decided, for a reader of the episode."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from forestrl.planners.viewpoints.paths import Paths
from forestrl.planners.viewpoints.sight import Sight
from forestrl.planners.viewpoints.views import Views


class Viewpoints(NamedTuple):
    """The viewpoints that a planner compared at one step, the best first."""

    cells: np.ndarray
    """(row, col), int64 ``[n, 2]``."""
    scores: np.ndarray
    """float64 ``[n]``; only their order and differences mean something."""
    way: np.ndarray
    """The cells from the robot's neighbour to the goal, int64 ``[m, 2]``; empty without a goal."""


class Outlook(NamedTuple):
    """One robot's map as a planner sees it."""

    views: Views
    lines: Sight
    stride: int
    paths: Paths


def compared(at: Outlook, cells: np.ndarray, scores: np.ndarray, goal: int) -> Viewpoints:
    """Lists the viewpoints that were compared and the way to the goal.

    Args:
        at: where the robot stands.
        cells: numbers of the viewpoints, int64 ``[n]``.
        scores: of each, ``[n]``.
        goal: the number of the cell that was chosen; negative if there is none.
    """
    way = []
    while goal >= 0 and at.paths.lengths[goal] > 0:
        way.append(goal)
        goal = at.paths.before[goal]
    order = np.argsort(-scores, kind="stable")
    return Viewpoints(_places(at, cells[order]), scores[order], _places(at, way[::-1]))


def _places(at: Outlook, cells: np.ndarray | list[int]) -> np.ndarray:
    """Gives (row, col) of cells on the flat map, int64 ``[n, 2]``."""
    flat = np.asarray(cells, np.int64).reshape(-1)
    return np.stack(np.divmod(flat, at.stride), -1) - at.lines.margin
