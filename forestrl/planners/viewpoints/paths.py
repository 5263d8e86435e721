"""Shortest paths over known free cells, and among them those that reveal most."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import UNREACHED, no_lengths
from forestrl.planners.viewpoints.sight import WORD, Sight, popcount
from forestrl.planners.viewpoints.views import Views


class Paths(NamedTuple):
    """Paths from the robot to every cell within reach."""

    lengths: np.ndarray
    """Moves to each cell, ``L``, int32 ``[cells]``; negative where none lead."""
    gains: np.ndarray
    """Unknown cells that could be seen on the way and at the end, ``G``, int32 ``[cells]``."""
    before: np.ndarray
    """The cell before each on the way that reveals most, int32 ``[cells]``."""
    order: np.ndarray
    """The cells within reach by their lengths, the robot's first, int32 ``[n]``."""


@compiled
def only_here(views: Views, here: int, there: int, shift: int) -> int:
    """Counts what could be seen from a cell and not from its neighbour.

    Args:
        views: of the map.
        here: the cell.
        there: the neighbour.
        shift: bits by which the step from ``there`` to ``here`` shifts what is seen.
    """
    seen, words = views.seen, views.seen.shape[1]
    count = 0
    if shift > 0:  # the cell lies further on: what is seen from the neighbour moves down
        down, up = np.uint64(shift), np.uint64(WORD - shift)
        for w in range(words):
            other = seen[there, w] >> down
            if w + 1 < words:
                other |= seen[there, w + 1] << up
            count += popcount(seen[here, w] & ~other)
    else:
        up, down = np.uint64(-shift), np.uint64(WORD + shift)
        for w in range(words):
            other = seen[there, w] << up
            if w > 0:
                other |= seen[there, w - 1] >> down
            count += popcount(seen[here, w] & ~other)
    return count


@compiled
def paths_from(views: Views, sight: Sight, source: int) -> Paths:
    """Walks breadth-first from the robot, keeping for each cell the way that reveals most.

    Among equal ways the one found first counts: by the order in which the cells before were
    reached, then by action.
    """
    lengths = no_lengths(views.grid)
    gains = np.zeros(len(lengths), np.int32)
    before = np.empty(len(lengths), np.int32)
    order = np.empty(len(lengths), np.int32)
    lengths[source], order[0], before[source] = 0, source, source
    head, tail = 0, 1
    while head < tail:
        cell = order[head]
        head += 1
        length, gain = lengths[cell] + 1, gains[cell]
        for action in range(8):
            near = np.uint64(cell + sight.steps[action])
            known = lengths[near]
            if known == UNREACHED:
                lengths[near] = length
                order[tail] = near
                tail += 1
                before[near] = cell
                if views.counts[near] > 0:
                    gains[near] = gain + only_here(views, near, cell, sight.shifts[action])
                else:
                    gains[near] = gain
            elif known == length:
                found = gain
                if views.counts[near] > 0:
                    if gain + views.counts[near] <= gains[near]:
                        continue
                    found += only_here(views, near, cell, sight.shifts[action])
                if found > gains[near]:
                    gains[near], before[near] = found, cell
    return Paths(lengths, gains, before, order[:tail])


@compiled
def first_step(paths: Paths, goal: int) -> int:
    """Gives the first cell of the way to a goal that is not the robot's own cell."""
    cell = goal
    while paths.lengths[cell] > 1:
        cell = paths.before[cell]
    return cell
