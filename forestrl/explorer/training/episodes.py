"""Whole episodes, compiled: an arena, its explorer, and the steps it takes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from forestrl.explorer.compiled import Weights
from forestrl.explorer.deciding import decide
from forestrl.explorer.training.world import Truth, lay_out, sense
from forestrl.kernels.batches import over_batch
from forestrl.kernels.compiling import compiled
from forestrl.planners.viewpoints.paths import first_step, paths_from
from forestrl.planners.viewpoints.scores import NOWHERE, Memory, no_memory, remember
from forestrl.planners.viewpoints.sight import Sight
from forestrl.planners.viewpoints.views import Views, blank


class Episode(NamedTuple):
    """Where an episode stands; arrays are written in place."""

    truth: Truth
    views: Views
    memory: Memory
    at: np.ndarray
    """The robot's cell, covered cells, steps, int64 ``[3]``."""


@compiled
def begin(trees: np.ndarray, row: int, col: int, lines: Sight) -> Episode:
    """Starts an episode: the first scan is done."""
    truth = lay_out(trees, row, col, lines)
    views = blank(trees.shape[0], trees.shape[1], lines)
    cell = (row + lines.margin) * (trees.shape[1] + 2 * lines.margin) + col + lines.margin
    at = np.empty(3, np.int64)
    at[0], at[1], at[2] = cell, sense(truth, views, lines, cell), 0
    return Episode(truth, views, no_memory(), at)


@compiled
def coverage(episode: Episode) -> np.float32:
    """Gives the share of traversable cells that are known, as the env does."""
    return np.float32(episode.at[1]) / np.float32(episode.truth.total)


@compiled
def advance(
    episode: Episode, lines: Sight, stride: int, weights: Weights, share: float, option: int
) -> int:
    """Takes a step.

    Args:
        episode: to go on with; written.
        lines: lines of sight.
        stride: of the map.
        weights: what the decisions are made of.
        share: the coverage to be reached.
        option: a cell to walk to; ``NOWHERE`` to decide.

    Returns:
        the goal; ``NOWHERE`` if there is none, and nothing was done.
    """
    views, memory, at = episode.views, episode.memory, episode.at
    paths = paths_from(views, lines, at[0])
    goal = option
    if option == NOWHERE:
        goal, _ = decide(views, lines, stride, paths, memory, weights, share)
        if goal == NOWHERE:
            return NOWHERE
    target = first_step(paths, goal)
    remember(memory, stride, at[0], target, goal)
    at[0] = target
    at[1] += sense(episode.truth, views, lines, target)
    at[2] += 1
    return goal


@compiled
def copied(episode: Episode) -> Episode:
    """Copies an episode, to go on with from the same state more than once."""
    views, memory = episode.views, episode.memory
    return Episode(
        episode.truth,
        Views(views.grid.copy(), views.seen.copy(), views.counts.copy()),
        Memory(memory.heading.copy(), memory.goal.copy(), memory.idle.copy()),
        episode.at.copy(),
    )


@over_batch
def explore(
    first: int,
    last: int,
    trees: np.ndarray,
    starts: np.ndarray,
    lines: Sight,
    weights: Weights,
    share: float,
    limit: int,
    steps: np.ndarray,
) -> None:
    """Explores arenas until a share of each is known.

    Args:
        first: of the arenas.
        last: of the arenas, exclusive.
        trees: bool ``[n, H, W]``.
        starts: cells, (row, col), int64 ``[n, 2]``.
        lines: lines of sight.
        weights: what the decisions are made of.
        share: the coverage to be reached.
        limit: of the steps.
        steps: taken; ``limit`` where the coverage was not reached; written, int64 ``[n]``.
    """
    stride = trees.shape[2] + 2 * lines.margin
    for i in range(first, last):
        episode = begin(trees[i], starts[i, 0], starts[i, 1], lines)
        while coverage(episode) < np.float32(share) and episode.at[2] < limit:
            if advance(episode, lines, stride, weights, share, NOWHERE) == NOWHERE:
                episode.at[2] = limit
        steps[i] = episode.at[2]
