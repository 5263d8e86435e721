"""Ways over known free cells: to a goal, and out of an obstacle."""

from __future__ import annotations

import numpy as np

from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import PAD, eight_steps, flood, no_lengths, pad


@compiled
def way(cells: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> np.ndarray:
    """Finds a shortest way over free cells, ties to the lower action.

    Args:
        cells: the map, uint8 ``[H, W]``.
        start: (row, col), free.
        goal: (row, col), free.

    Returns:
        (row, col) of its cells from start to goal, both included, int64 ``[n, 2]``; none if there
        is no way.
    """
    stride = cells.shape[1] + 2 * PAD
    steps, lengths = eight_steps(stride), no_lengths(pad(cells))
    source = (start[0] + PAD) * stride + start[1] + PAD
    target = (goal[0] + PAD) * stride + goal[1] + PAD
    queue = np.empty(len(lengths), np.int32)
    queue[0], lengths[target] = target, 0
    flood(steps, lengths, queue, 0, 1, source)
    if lengths[source] < 0:
        return np.empty((0, 2), np.int64)
    places = np.empty((lengths[source] + 1, 2), np.int64)
    cell = source
    for i in range(len(places)):
        places[i, 0], places[i, 1] = cell // stride - PAD, cell % stride - PAD
        for step in steps:
            if lengths[cell + step] >= 0 and lengths[cell + step] == lengths[cell] - 1:
                cell += step
                break
    return places


@compiled
def way_out(bare: np.ndarray, cells: np.ndarray, start: tuple[int, int]) -> np.ndarray:
    """Finds a shortest way from an obstacle to a free cell, ties to the lower action.

    Args:
        bare: the map as it was seen, uint8 ``[H, W]``: the way leads over its free cells.
        cells: the map for planning: the way ends in one of its free cells.
        start: (row, col).

    Returns:
        (row, col) of its cells, int64 ``[n, 2]``, without the start; none if there is no way.
    """
    stride = bare.shape[1] + 2 * PAD
    steps, lengths, wanted = eight_steps(stride), no_lengths(pad(bare)), no_lengths(pad(cells))
    queue, before = np.empty(len(lengths), np.int32), np.empty(len(lengths), np.int32)
    source = (start[0] + PAD) * stride + start[1] + PAD
    queue[0], lengths[source] = source, 0
    head, tail = 0, 1
    while head < tail:
        cell = queue[head]
        head += 1
        if wanted[cell] == -1 and cell != source:
            places = np.empty((lengths[cell], 2), np.int64)
            for i in range(len(places) - 1, -1, -1):
                places[i, 0], places[i, 1] = cell // stride - PAD, cell % stride - PAD
                cell = before[cell]
            return places
        for step in steps:
            if lengths[cell + step] == -1:
                lengths[cell + step], before[cell + step] = lengths[cell] + 1, cell
                queue[tail] = cell + step
                tail += 1
    return np.empty((0, 2), np.int64)
