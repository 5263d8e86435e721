"""The planner that knows the whole arena beforehand: an estimate of what is attainable at all."""

from __future__ import annotations

from typing import Annotated

import torch
from torch import Tensor

from forestrl import functional as F
from forestrl import keys as K
from forestrl.planners.base import ClassicalPlanner, Key
from forestrl.planners.hindsight import annealing
from forestrl.settings import Range, checked
from forestrl.status import Status

_PATH, _START = ("planner", "path"), ("planner", "start")


class Hindsight(ClassicalPlanner):
    """Walks a short way through an arena that it sees as a whole, trees and all.

    The way is planned at the first step: greedily to the cell that shows most per move, by true
    path lengths, then varied at random (parts of the sequence of viewpoints reversed, moved, left
    out, added or shifted) so that the coverage goal is reached in fewer steps. The rest follows
    after the goal. No planner that has to find out can be expected to be as fast, and a faster walk
    may exist.

    Args:
        coverage_goal: the coverage to reach in few steps, a share of the traversable cells.
        lidar_range: sensor range ``l``, cells; the env's.
        iterations: variations tried in each arena; 0: the greedy way.

    Raises:
        ValueError: if a value is out of its range.
    """

    @checked
    def __init__(
        self,
        coverage_goal: Annotated[float, Range(above=0, high=1)] = 0.98,
        lidar_range: Annotated[float, Range(1.415, 100)] = 5.0,
        iterations: Annotated[int, Range(0, 1_000_000_000)] = 20_000,
    ) -> None:
        super().__init__(reads=[K.TREES, K.STEP_COUNT], remembers=[_PATH, _START])
        self.coverage_goal, self.iterations = coverage_goal, iterations
        self.sight_lines = F.sight_lines(lidar_range)

    def plan(self, entries: dict[Key, Tensor], changed: Tensor) -> tuple[Tensor, Tensor]:
        """Plans the whole way where there is none yet, and takes its next step."""
        steps = entries[K.STEP_COUNT].squeeze(-1)
        if _PATH not in entries:
            trees = entries[K.TREES]
            entries[_PATH] = torch.zeros(len(trees), trees[0].numel(), dtype=torch.int8)
            entries[_START] = steps.clone()
            new = torch.ones_like(steps, dtype=torch.bool)
        else:
            new = steps == 0
        if new.any():
            entries[_START] = torch.where(new, steps, entries[_START])
            entries[_PATH][new] = annealing.plan(
                entries[K.TREES][new],
                entries[K.POSITION][new],
                self.sight_lines,
                share=self.coverage_goal,
                iterations=self.iterations,
            )
        index = (steps - entries[_START]).clamp(0, entries[_PATH].shape[-1] - 1)
        action = entries[_PATH].gather(-1, index.unsqueeze(-1)).squeeze(-1).long()
        ended = (action == F.NULL_ACTION) | (steps - entries[_START] > index)
        status = torch.where(ended, int(Status.COVERED), int(Status.EXPLORING))
        return action.where(~ended, F.NULL_ACTION), status
