"""An arena that is known beforehand, as lists of what can be seen and reached, compiled.

Cells are numbered 0 .. n-1 over the traversable cells, in the order of their distance from the
start, which is cell 0. A *viewpoint* is a cell to walk to; the walk towards one ends as soon as all
that can be seen from it has been seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import PAD, eight_steps, pad, walk

NEVER = 1 << 30  # later than any step


class World(NamedTuple):
    """An arena as lists of cells."""

    near: np.ndarray
    """The cell each action leads to, -1 if none, ``[n, 8]``."""
    first: np.ndarray
    """Where the list of cells seen from each cell begins in ``seen``, ``[n + 1]``."""
    seen: np.ndarray
    """Those lists, one after the other."""
    first_new: np.ndarray
    """Where the list of each move (8 * cell + action) begins in ``new``, ``[8 n + 1]``."""
    new: np.ndarray
    """Cells that are seen after a move and not before it, one list after the other."""


@compiled
def describe(
    trees: np.ndarray, row: int, col: int, offsets: np.ndarray, between: np.ndarray
) -> World:
    """Lists an arena from the start at a row and column, for a sensor's lines of sight."""
    height, width = trees.shape
    stride = width + 2 * PAD
    cells = np.empty(trees.shape, np.uint8)
    for r in range(height):
        for c in range(width):
            cells[r, c] = 2 if trees[r, c] else 1
    grid, steps = pad(cells), eight_steps(stride)
    _, order, n = walk(grid, steps, (row + PAD) * stride + col + PAD)
    number = np.full(len(grid), -1, np.int32)
    for i in range(n):
        number[order[i]] = i
    near = np.empty((n, 8), np.int32)
    first, seen = np.zeros(n + 1, np.int32), np.empty(n * len(offsets), np.int32)
    total = 0
    for i in range(n):
        for action in range(8):
            near[i, action] = number[order[i] + steps[action]]
        r, c = order[i] // stride - PAD, order[i] % stride - PAD
        for k in range(len(offsets)):
            r2, c2 = r + offsets[k, 0], c + offsets[k, 1]
            if r2 < 0 or r2 >= height or c2 < 0 or c2 >= width:
                continue
            other = number[(r2 + PAD) * stride + c2 + PAD]
            hidden = other < 0
            for m in range(between.shape[1]):
                if hidden:
                    break
                hidden = trees[r + between[k, m, 0], c + between[k, m, 1]]
            if not hidden:
                seen[total] = other
                total += 1
        first[i + 1] = total
    first_new, new = _moves(near, first, seen[:total])
    return World(near, first, seen[:total], first_new, new)


@compiled
def _moves(near: np.ndarray, first: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lists what each move shows that its first cell does not."""
    n = len(near)
    stamp = np.full(n, -1, np.int32)
    first_new, new = np.zeros(8 * n + 1, np.int32), np.empty(3 * len(seen) + 64, np.int32)
    total = 0
    for i in range(n):
        for s in range(first[i], first[i + 1]):
            stamp[seen[s]] = i
        for action in range(8):
            j = near[i, action]
            if j >= 0:
                if total + first[j + 1] - first[j] > len(new):
                    new = np.concatenate((new, np.empty(len(new), np.int32)))
                for s in range(first[j], first[j + 1]):
                    if stamp[seen[s]] != i:
                        new[total] = seen[s]
                        total += 1
            first_new[8 * i + action + 1] = total
    return first_new, new[:total]


@compiled
def distances(near: np.ndarray, source: int, lengths: np.ndarray, queue: np.ndarray) -> None:
    """Writes the number of moves from a cell to every other."""
    lengths[:] = -1
    lengths[source] = 0
    queue[0], head, tail = source, 0, 1
    while head < tail:
        cell = queue[head]
        head += 1
        for action in range(8):
            j = near[cell, action]
            if j >= 0 and lengths[j] < 0:
                lengths[j] = lengths[cell] + 1
                queue[tail] = j
                tail += 1


@compiled
def look(world: World, cell: int, known: np.ndarray) -> int:
    """Takes a whole scan from a cell and returns how much is new."""
    count = 0
    for s in range(world.first[cell], world.first[cell + 1]):
        if not known[world.seen[s]]:
            known[world.seen[s]] = True
            count += 1
    return count


@compiled
def go(
    world: World,
    cell: int,
    viewpoint: int,
    lengths: np.ndarray,
    known: np.ndarray,
    actions: np.ndarray,
    steps: int,
    count: int,
    goal: int,
) -> tuple[int, int, int, int]:
    """Walks towards a viewpoint for as long as it has something to show.

    Args:
        world: the arena.
        cell: where the walk is.
        viewpoint: where it goes.
        lengths: moves from every cell to there.
        known: which cells are known; written.
        actions: the walk; written.
        steps: length of the walk so far.
        count: how many cells are known.
        goal: how many are wanted.

    Returns:
        cell, steps and count at the end, and the step at which the goal was reached, or ``NEVER``.
    """
    s, end = world.first[viewpoint], world.first[viewpoint + 1]
    when = NEVER
    while steps < len(actions):
        while s < end and known[world.seen[s]]:
            s += 1
        if s == end:
            break
        action = 0
        while (
            world.near[cell, action] < 0 or lengths[world.near[cell, action]] != lengths[cell] - 1
        ):
            action += 1
        move = 8 * cell + action
        for i in range(world.first_new[move], world.first_new[move + 1]):
            if not known[world.new[i]]:
                known[world.new[i]] = True
                count += 1
        cell = world.near[cell, action]
        actions[steps] = action + 1
        steps += 1
        if count >= goal and when == NEVER:
            when = steps
    return cell, steps, count, when


@compiled
def follow(
    world: World,
    order: np.ndarray,
    size: int,
    places: np.ndarray,
    lengths: np.ndarray,
    known: np.ndarray,
    actions: np.ndarray,
    goal: int,
    limit: int,
) -> tuple[int, int, int, int]:
    """Walks to the viewpoints in order until the goal is reached or ``limit`` steps are gone.

    Returns:
        cell, steps and count at the end, and the step at which the goal was reached, or ``NEVER``.
    """
    known[:] = False
    count = look(world, 0, known)
    cell, steps = 0, 0
    if count >= goal:
        return cell, steps, count, 0
    for i in range(size):
        slot = order[i]
        cell, steps, count, when = go(
            world, cell, places[slot], lengths[slot], known, actions, steps, count, goal
        )
        if when < NEVER:
            return cell, steps, count, when
        if steps > limit:
            break
    return cell, steps, count, NEVER
