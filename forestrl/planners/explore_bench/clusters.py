"""Explore-Bench's frontiers and their clusters, compiled; maps are those of ``planning.pad``."""

from __future__ import annotations

import numpy as np

from forestrl.functional import Cell
from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import PAD

_UNKNOWN, _FREE = int(Cell.UNKNOWN), int(Cell.FREE)


@compiled
def published_frontier(grid: np.ndarray, stride: int) -> np.ndarray:
    """Lists unknown cells beside a free one that is not alone, in row-major order.

    Beside such a cell c, in one of the four directions d, n = c + d is free, and so is n + d or a
    neighbour of n at right angles to d.
    """
    found = np.empty(len(grid), np.int32)
    count = 0
    for cell in range(PAD * stride, len(grid) - PAD * stride):
        if grid[cell] != _UNKNOWN:
            continue
        for ahead, aside in ((stride, 1), (1, stride), (-stride, 1), (-1, stride)):
            near = cell + ahead
            if grid[near] == _FREE and (
                grid[near + ahead] == _FREE
                or grid[near + aside] == _FREE
                or grid[near - aside] == _FREE
            ):
                found[count] = cell
                count += 1
                break
    return found[:count]


@compiled
def corrected_frontier(
    grid: np.ndarray, steps: np.ndarray, stride: int, lengths: np.ndarray
) -> np.ndarray:
    """Lists unknown cells beside one of the eight neighbours that can be reached, row-major.

    Those that the published rule finds; only if it finds none, all.
    """
    found = published_frontier(grid, stride)
    count = _beside_reached(found, steps, lengths)
    if count == 0:
        found = np.nonzero(grid == _UNKNOWN)[0].astype(np.int32)
        count = _beside_reached(found, steps, lengths)
    return found[:count]


@compiled
def _beside_reached(found: np.ndarray, steps: np.ndarray, lengths: np.ndarray) -> int:
    """Keeps the listed cells beside one that can be reached, and returns how many they are."""
    count = 0
    for cell in found:
        for step in steps:
            if lengths[cell + step] >= 0:
                found[count] = cell
                count += 1
                break
    return count


@compiled
def _close(stride: int) -> np.ndarray:
    """Differences of cell number to the twelve cells at a Manhattan distance of 1 or 2."""
    near = np.empty(12, np.int32)
    n = 0
    for r in range(-2, 3):
        for c in range(-2, 3):
            if 0 < abs(r) + abs(c) <= 2:
                near[n] = r * stride + c
                n += 1
    return near


@compiled
def _first_grown(
    members: np.ndarray, tied: np.ndarray, state: np.ndarray, close: np.ndarray
) -> int:
    """Tells which of the tied members comes first when the cluster grows.

    Growth begins with the last member; the others are gone through backwards, again and again, and
    each joins that is close to one that has.

    Args:
        members: cells of the cluster in row-major order.
        tied: which of them are candidates.
        state: 2 at members that have not joined, none of them has; 3 is written where one does.
        close: from :func:`_close`.
    """
    last = len(members) - 1
    state[members[last]] = 3
    if tied[last]:
        return members[last]
    while True:
        for i in range(last - 1, -1, -1):
            if state[members[i]] == 3:
                continue
            for step in close:
                if state[members[i] + step] == 3:
                    state[members[i]] = 3
                    break
            if state[members[i]] == 3 and tied[i]:
                return members[i]


@compiled
def _centre(members: np.ndarray, state: np.ndarray, close: np.ndarray, stride: int) -> int:
    """Gives the member with the least Manhattan distance to their mean, the first grown of them."""
    n = len(members)
    row_sum = col_sum = 0
    for cell in members:
        row_sum += cell // stride
        col_sum += cell % stride
    distance = np.empty(n, np.int64)
    for i in range(n):  # times n, so that it is a whole number
        row, col = members[i] // stride, members[i] % stride
        distance[i] = abs(n * row - row_sum) + abs(n * col - col_sum)
    tied = distance == distance.min()
    if tied.sum() == 1:
        return members[distance.argmin()]
    return _first_grown(members, tied, state, close)


@compiled
def clusters(found: np.ndarray, size: int, stride: int) -> tuple[np.ndarray, np.ndarray]:
    """Groups frontier cells: two are in one cluster if a chain of Manhattan distances <= 2 joins.

    Args:
        found: the frontier cells in row-major order.
        size: cells of the padded map.
        stride: of the padded map.

    Returns:
        the centre and the number of cells of each cluster, the one with the last cell first, then
        the one with the last cell of those that remain, and so on.
    """
    close = _close(stride)
    state = np.zeros(size, np.uint8)  # 1: not in a cluster yet, 2: in one
    for cell in found:
        state[cell] = 1
    centres, sizes = np.empty(len(found), np.int32), np.empty(len(found), np.int32)
    queue = np.empty(len(found), np.int32)
    count = 0
    for i in range(len(found) - 1, -1, -1):
        if state[found[i]] != 1:
            continue
        queue[0], head, tail = found[i], 0, 1
        state[found[i]] = 2
        while head < tail:
            for step in close:
                near = queue[head] + step
                if state[near] == 1:
                    state[near] = 2
                    queue[tail] = near
                    tail += 1
            head += 1
        members = np.sort(queue[:tail])
        centres[count] = _centre(members, state, close, stride)
        sizes[count] = tail
        count += 1
    return centres[:count], sizes[:count]
