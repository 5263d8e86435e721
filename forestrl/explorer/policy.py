"""The policy that walks to the viewpoint with the highest score."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from tensordict import TensorDictBase
from torch import Tensor

from forestrl import keys as K
from forestrl.explorer.compiled import Weights
from forestrl.explorer.deciding import compared, decide
from forestrl.kernels.batches import grids, over_batch, rows
from forestrl.planners.base import ClassicalPlanner, Key
from forestrl.planners.steps import EXPLORING, status_at_end
from forestrl.planners.viewpoints import considered
from forestrl.planners.viewpoints.path_gain import (
    COUNTS,
    GRID,
    SEEN,
    action_to,
    look,
    outlook,
    remembered_views,
)
from forestrl.planners.viewpoints.paths import first_step, paths_from
from forestrl.planners.viewpoints.scores import NOWHERE, Memory, no_memory, remember
from forestrl.planners.viewpoints.sight import Sight, sight
from forestrl.planners.viewpoints.views import Views
from forestrl.settings import not_allowed

HEADING, GOAL, IDLE = ("planner", "heading"), ("planner", "goal"), ("planner", "idle")
"""What is remembered besides the views: the parts of ``Memory``."""


class ViewpointPolicy(ClassicalPlanner):
    """Takes a step to the viewpoint with the highest score, deciding anew at every step.

    It is deterministic, and never in a cycle: when nothing new was seen for longer than the longest
    path takes, it goes to the nearest cell from which something could be seen.

    Args:
        weights: what the decision is made of.
        lidar_range: sensor range ``l``, cells; the env's.
        coverage_goal: the coverage to be reached.
        deterministic: whether it is; there is no other way.

    Raises:
        ValueError: if it is asked to sample.
    """

    deterministic = True

    def __init__(
        self,
        weights: Weights,
        lidar_range: float,
        coverage_goal: float,
        deterministic: bool | None = None,
    ) -> None:
        if deterministic is False:
            reason = "a policy that compares viewpoints is always deterministic"
            raise not_allowed("deterministic", deterministic, reason)
        super().__init__(
            remembers=[GRID, SEEN, COUNTS, HEADING, GOAL, IDLE, K.GUARDED, K.TARGET],
            can_cycle=False,
        )
        self.weights, self.lidar_range, self.coverage_goal = weights, lidar_range, coverage_goal
        self.file: Any = None
        """The policy file it is out of, if it is."""

    def plan(self, entries: dict[Key, Tensor], changed: Tensor) -> tuple[Tensor, Tensor]:
        """Plans one step."""
        cells = entries[K.CELLS]
        n = len(cells)
        lines = sight(self.lidar_range, cells.shape[-1])
        views = remembered_views(entries, lines)
        if HEADING not in entries:
            entries[HEADING] = torch.zeros(n, 2, dtype=torch.float64)
            entries[GOAL] = torch.full((n, 1), NOWHERE)
            entries[IDLE] = torch.zeros(n, 2, dtype=torch.int64)
        for key in (HEADING, GOAL, IDLE):
            entries[key] = entries[key].contiguous()
        memory = [entries[key].numpy() for key in (HEADING, GOAL, IDLE)]
        guarded = entries[K.GUARDED] = torch.zeros(n, dtype=torch.bool)
        entries[K.TARGET] = torch.full((n, 2), -1)
        action = torch.zeros(n, dtype=torch.int64)
        status = torch.zeros(n, dtype=torch.int8)
        _plan(
            grids(cells),
            rows(entries[K.POSITION]),
            *views,
            *memory,
            lines,
            self.weights,
            self.coverage_goal,
            action.numpy(),
            status.numpy(),
            guarded.numpy(),
            entries[K.TARGET].numpy(),
        )
        return action, status

    def viewpoints(self, step: TensorDictBase) -> considered.Viewpoints:
        """Gives what is compared in a state without batch dimensions, before the decision."""
        at, memory = outlook(step, self.lidar_range), no_memory()
        for key, part in zip((HEADING, GOAL, IDLE), memory, strict=True):
            if (value := step.get(key, None)) is not None:
                part[:] = value.cpu().numpy()
        share = self.coverage_goal
        where = (at.views, at.lines, at.stride, at.paths, memory, self.weights, share)
        cells, scores, _ = compared(*where)
        goal, _ = decide(*where)
        return considered.compared(at, cells, scores, goal)


@over_batch
def _plan(
    begin: int,
    end: int,
    cells: np.ndarray,
    position: np.ndarray,
    grid: np.ndarray,
    seen: np.ndarray,
    counts: np.ndarray,
    heading: np.ndarray,
    goal: np.ndarray,
    idle: np.ndarray,
    lines: Sight,
    weights: Weights,
    share: float,
    action: np.ndarray,
    status: np.ndarray,
    guarded: np.ndarray,
    goals: np.ndarray,
) -> None:
    stride = cells.shape[2] + 2 * lines.margin
    for b in range(begin, end):
        views, memory = Views(grid[b], seen[b], counts[b]), Memory(heading[b], goal[b], idle[b])
        source = look(views, lines, cells[b], position[b, 0], position[b, 1])
        paths = paths_from(views, lines, source)
        to, guarded[b] = decide(views, lines, stride, paths, memory, weights, share)
        if to == NOWHERE:
            action[b], status[b] = 0, status_at_end(grid[b], lines.steps, stride)
        else:
            target = first_step(paths, to)
            action[b], status[b] = action_to(lines, source, target), EXPLORING
            remember(memory, stride, source, target, to)
            goals[b, 0], goals[b, 1] = to // stride - lines.margin, to % stride - lines.margin
