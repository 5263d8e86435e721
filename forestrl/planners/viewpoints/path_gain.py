"""The planner that takes the way on which most is to be seen for its length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
import torch
from tensordict import TensorDictBase
from torch import Tensor

from forestrl import keys as K
from forestrl.kernels.batches import grids, over_batch, rows
from forestrl.kernels.compiling import compiled
from forestrl.planners.base import ClassicalPlanner, Key
from forestrl.planners.steps import EXPLORING, status_at_end
from forestrl.planners.viewpoints.candidates import candidates, distance_apart
from forestrl.planners.viewpoints.considered import Outlook, Viewpoints, compared
from forestrl.planners.viewpoints.paths import first_step, paths_from
from forestrl.planners.viewpoints.scores import NOWHERE, path_gain
from forestrl.planners.viewpoints.sight import Sight, sight
from forestrl.planners.viewpoints.views import Views, blank, spend, update
from forestrl.settings import Range, checked

_LISTED = 16  # viewpoints, at most, for a reader of the episode
GRID, SEEN, COUNTS = ("planner", "grid"), ("planner", "seen"), ("planner", "counts")
"""What could be seen, kept up from step to step: the parts of ``Views``."""


class PathGain(ClassicalPlanner):
    r"""Takes a step on the way that shows most for its length, planning anew at every step.

    For every known free cell ``v`` within reach, ``S(v)`` are the unknown cells within range whose
    line of sight no *known* trunk blocks, ``L(v)`` is the path length and ``G(v)`` how much could
    be seen along the best shortest path, ``max over u before v of G(u) + |S(v) \ S(u)|``. The goal
    is the largest ``(G(v) + |S(v)|) / L(v)^power``; the step is the first on that path. Many paths
    are equally short, as diagonal moves cost no more than others; taking the one that shows most is
    what sets this planner ahead.

    Ties go to the first cell in row-major order, and among ways to the one found first. What could
    be seen is kept up between steps; a map that does not follow from the one before is looked at
    anew.

    Args:
        lidar_range: sensor range ``l``, cells; the env's.
        power: exponent of the path length.

    Raises:
        ValueError: if a value is out of its range.
    """

    @checked
    def __init__(
        self,
        lidar_range: Annotated[float, Range(1.415, 100)] = 5.0,
        power: Annotated[float, Range(0, 10)] = 1.4,
    ) -> None:
        super().__init__(remembers=[GRID, SEEN, COUNTS, K.TARGET])
        self.lidar_range, self.power = lidar_range, power

    def plan(self, entries: dict[Key, Tensor], changed: Tensor) -> tuple[Tensor, Tensor]:
        """Plans one step."""
        cells = entries[K.CELLS]
        lines = sight(self.lidar_range, cells.shape[-1])
        action = torch.zeros(len(cells), dtype=torch.int64)
        status = torch.zeros(len(cells), dtype=torch.int8)
        remembered = remembered_views(entries, lines)
        place = rows(entries[K.POSITION])
        entries[K.TARGET] = torch.full((len(cells), 2), -1)
        results = action.numpy(), status.numpy(), entries[K.TARGET].numpy()
        _plan(grids(cells), place, *remembered, lines, self.power, *results)
        return action, status

    def viewpoints(self, step: TensorDictBase) -> Viewpoints:
        """Gives the best viewpoints of a state without batch dimensions, before the decision."""
        at = outlook(step, self.lidar_range)
        shows = at.paths.gains > 0
        scores = np.full(len(shows), -np.inf)
        gain = (at.paths.gains + at.views.counts)[shows]
        scores[shows] = gain / at.paths.lengths[shows].astype(float) ** self.power
        apart = distance_apart(self.lidar_range / 5)
        few = candidates(at.paths, at.stride, scores[at.paths.order], apart, _LISTED)
        return compared(at, few, scores[few], path_gain(at.views, at.paths, self.power))


def outlook(step: TensorDictBase, lidar_range: float) -> Outlook:
    """Looks around with what a planner remembers, leaving that as it is.

    Args:
        step: a state without batch dimensions.
        lidar_range: sensor range ``l``, cells.
    """
    cells, (row, col) = step[K.CELLS].cpu(), step[K.POSITION].tolist()
    lines = sight(lidar_range, cells.shape[1])
    entries: dict[Key, Tensor] = {K.CELLS: cells[None]}
    for key in (GRID, SEEN, COUNTS):
        if (value := step.get(key, None)) is not None:
            entries[key] = value[None].cpu().clone()
    grid, seen, counts = remembered_views(entries, lines)
    views = Views(grid[0], seen[0], counts[0])
    source = look(views, lines, cells.numpy(), row, col)
    stride = cells.shape[1] + 2 * lines.margin
    return Outlook(views, lines, stride, paths_from(views, lines, source))


def remembered_views(entries: dict[Key, Tensor], lines: Sight) -> Sequence[np.ndarray]:
    """Gives the views of every arena as arrays that are written in place; blank at the first step.

    Args:
        entries: of a planner; gets ``GRID``, ``SEEN`` and ``COUNTS`` where they are not there.
        lines: lines of sight for the stride of the maps.

    Returns:
        grid uint8 ``[n, cells]``, seen uint64 ``[n, cells, words]``, counts int32 ``[n, cells]``.
    """
    n, height, width = entries[K.CELLS].shape
    if GRID not in entries:
        fresh = blank(height, width, lines)
        for key, value in (
            (GRID, fresh.grid),
            (SEEN, fresh.seen.view(np.int64)),
            (COUNTS, fresh.counts),
        ):
            entries[key] = torch.from_numpy(np.repeat(value[None], n, 0))
    grid, seen, counts = (entries[key].contiguous() for key in (GRID, SEEN, COUNTS))
    entries[GRID], entries[SEEN], entries[COUNTS] = grid, seen, counts
    return grid.numpy(), seen.numpy().view(np.uint64), counts.numpy()


@compiled
def look(views: Views, lines: Sight, cells: np.ndarray, row: int, col: int) -> int:
    """Brings the views to the robot's map and cell; returns the number of that cell."""
    update(views, lines, cells)
    source = (row + lines.margin) * (cells.shape[1] + 2 * lines.margin) + col + lines.margin
    spend(views, source)
    return source


@over_batch
def _plan(
    first: int,
    last: int,
    cells: np.ndarray,
    position: np.ndarray,
    grid: np.ndarray,
    seen: np.ndarray,
    counts: np.ndarray,
    lines: Sight,
    power: float,
    action: np.ndarray,
    status: np.ndarray,
    target: np.ndarray,
) -> None:
    for b in range(first, last):
        views = Views(grid[b], seen[b], counts[b])
        source = look(views, lines, cells[b], position[b, 0], position[b, 1])
        paths = paths_from(views, lines, source)
        goal = path_gain(views, paths, power)
        stride = cells.shape[2] + 2 * lines.margin
        if goal == NOWHERE:
            action[b], status[b] = 0, status_at_end(grid[b], lines.steps, stride)
        else:
            action[b] = action_to(lines, source, first_step(paths, goal))
            status[b] = EXPLORING
            target[b, 0], target[b, 1] = goal // stride - lines.margin, goal % stride - lines.margin


@compiled
def action_to(lines: Sight, source: int, target: int) -> int:
    """Gives the action that leads to a neighbouring cell."""
    for i in range(8):
        if source + lines.steps[i] == target:
            return i + 1
    return 0
