"""A short walk through an arena that is known beforehand, compiled: what is attainable at all."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from forestrl.functional import SightLines
from forestrl.kernels.batches import grids, over_batch, rows
from forestrl.kernels.compiling import compiled
from forestrl.planners.hindsight.known_arena import (
    NEVER,
    World,
    describe,
    distances,
    follow,
    go,
    look,
)

_WARM, _COLD = 3.0, 0.2  # temperatures at the beginning and the end, steps
_SEED = np.uint64(0x9E3779B97F4A7C15)


@compiled
def _greedy(
    world: World,
    cell: int,
    known: np.ndarray,
    actions: np.ndarray,
    steps: int,
    count: int,
    viewpoints: np.ndarray,
) -> tuple[int, int]:
    """Goes on to the cell that shows most per move, again and again, until all is known.

    Returns:
        the number of viewpoints, which are written, and the steps in all.
    """
    n = len(world.near)
    lengths, queue = np.empty(n, np.int32), np.empty(n, np.int32)
    size = 0
    while count < n and steps < len(actions) and size < len(viewpoints):
        distances(world.near, cell, lengths, queue)
        best, best_score = -1, 0.0
        for i in range(n):
            gain = 0
            for s in range(world.first[i], world.first[i + 1]):
                gain += not known[world.seen[s]]
            if gain > best_score * lengths[i]:
                best, best_score = i, gain / lengths[i]
        distances(world.near, best, lengths, queue)
        viewpoints[size] = best
        size += 1
        cell, steps, count, _ = go(world, cell, best, lengths, known, actions, steps, count, n + 1)
    return size, steps


@compiled
def _draw(state: np.ndarray, below: int) -> int:
    """Draws a whole number from 0 to ``below - 1`` (xorshift64)."""
    x = state[0]
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    state[0] = x
    return int((x >> np.uint64(33)) % np.uint64(below))


@compiled
def _vary(order: np.ndarray, size: int, new: np.ndarray, kind: int, state: np.ndarray) -> None:
    """Writes a reordered tour: a part of it reversed (2-opt), or one to three moved (Or-opt)."""
    new[:size] = order[:size]
    a, b = _draw(state, size), _draw(state, size)
    if kind == 0:
        b = min(a + 1 + _draw(state, 12), size - 1)
        for i in range(a, b + 1):
            new[i] = order[a + b - i]
        return
    length = min(1 + _draw(state, 3), size)
    a = min(a, size - length)
    b = min(b, size - length)  # where the part begins afterwards
    if b < a:
        new[b + length : a + length] = order[b:a]
    else:
        new[a:b] = order[a + length : b + length]
    new[b : b + length] = order[a : a + length]


@compiled
def _improve(
    world: World, order: np.ndarray, size: int, places: np.ndarray, goal: int, iterations: int
) -> tuple[np.ndarray, np.ndarray, int]:
    """Varies a tour at random, keeping what shortens it and, while warm, a little of what does not.

    Besides reversing and moving parts, a viewpoint is added, left out, or shifted to a cell nearby.

    Returns:
        the best tour as slots, the distances to the viewpoint of each slot, and its steps.
    """
    n = len(world.near)
    room = len(order)
    state = np.array([_SEED])
    lengths, queue = np.empty((room + 1, n), np.int32), np.empty(n, np.int32)
    known, actions = np.empty(n, np.bool_), np.empty(4 * n, np.int8)
    for i in range(size):
        distances(world.near, places[i], lengths[i], queue)
    spare = np.arange(room, -1, -1)  # slots not in use, the last first
    spares = room + 1 - size
    new = np.empty(room, np.int64)
    now = follow(world, order, size, places, lengths, known, actions, goal, NEVER)[3]
    best, best_size = now, size
    best_places = places[order[:size]]
    for t in range(iterations):
        if size == 0:
            break
        kind = _draw(state, 8)
        new_size, used = size, -1
        a = _draw(state, size)
        if kind < 4:
            _vary(order, size, new, kind % 2, state)
        elif kind == 4:  # left out
            new[:a], new[a : size - 1] = order[:a], order[a + 1 : size]
            new_size = size - 1
        elif size < room or kind > 5:  # added, or shifted
            used = spare[spares - 1]
            place = places[order[a]]
            seen = world.seen[world.first[place] : world.first[place + 1]]
            places[used] = seen[_draw(state, len(seen))]
            distances(world.near, places[used], lengths[used], queue)
            if kind == 5:
                new[:a], new[a], new[a + 1 : size + 1] = order[:a], used, order[a:size]
                new_size = size + 1
            else:
                new[:size] = order[:size]
                new[a] = used
        else:
            continue
        warmth = _WARM * (_COLD / _WARM) ** (t / iterations)
        allowed = now - warmth * np.log((1 + _draw(state, 1 << 20)) / (1 << 20))
        took = follow(world, new, new_size, places, lengths, known, actions, goal, int(allowed))[3]
        if took > allowed:
            continue
        if used >= 0:
            spares -= 1
        if kind == 4 or kind > 5:
            spare[spares] = order[a]
            spares += 1
        now, size = took, new_size
        order[:size] = new[:size]
        if now < best:
            best, best_size = now, size
            best_places = places[order[:size]]
    for i in range(best_size):
        distances(world.near, best_places[i], lengths[i], queue)
    return best_places, lengths, best


@over_batch
def _plan(
    first: int,
    last: int,
    trees: np.ndarray,
    position: np.ndarray,
    offsets: np.ndarray,
    between: np.ndarray,
    share: float,
    iterations: int,
    out: np.ndarray,
) -> None:
    for b in range(first, last):
        world = describe(trees[b], position[b, 0], position[b, 1], offsets, between)
        n = len(world.near)
        goal = int(np.ceil(share * n))
        known = np.zeros(n, np.bool_)
        count = look(world, 0, known)
        viewpoints = np.empty(n, np.int32)
        size, _ = _greedy(world, 0, known, out[b], 0, count, viewpoints)
        room = size + 32
        places = np.zeros(room + 1, np.int32)
        places[:size] = viewpoints[:size]
        order = np.arange(room)
        places, lengths, _ = _improve(world, order, size, places, goal, iterations)
        out[b] = 0
        cell, steps, count, _ = follow(
            world, np.arange(room), len(places), places, lengths, known, out[b], goal, NEVER
        )
        _greedy(world, cell, known, out[b], steps, count, viewpoints)


def plan(
    trees: Tensor, position: Tensor, lines: SightLines, *, share: float, iterations: int
) -> Tensor:
    """Plans a short walk that shows a share of the traversable cells, and then the rest.

    Greedy first: again and again to the cell that shows most per move, by true path lengths. The
    order and places of these viewpoints are then varied at random, with a fixed seed.

    Args:
        trees: the true arena, bool ``[*B, H, W]``.
        position: the start, int64 ``[*B, 2]``.
        lines: of the sensor.
        share: the coverage that is to be reached in few steps.
        iterations: variations tried for each arena.

    Returns:
        the actions, int8 ``[*B, H * W]``, 0 after the last one; a walk longer than that is cut.
    """
    arenas = grids(trees)
    out = torch.zeros(len(arenas), trees.shape[-2] * trees.shape[-1], dtype=torch.int8)
    _plan(
        arenas,
        rows(position),
        lines.offsets.numpy(),
        lines.between.numpy(),
        share,
        iterations,
        out.numpy(),
    )
    return out.view(*trees.shape[:-2], -1)
