"""A* on the padded maps of ``planning.pad``, compiled."""

from __future__ import annotations

import numpy as np

from forestrl.functional import Cell
from forestrl.kernels.compiling import compiled
from forestrl.kernels.flood import eight_steps

_FREE = int(Cell.FREE)
_ROOM = 512  # entries of the heap at first


@compiled
def _push(keys: np.ndarray, cells: np.ndarray, size: int, key: float, cell: int) -> None:
    """Adds an entry to a heap ordered by key, then cell."""
    i = size
    while i > 0:
        up = (i - 1) // 2
        if keys[up] < key or (keys[up] == key and cells[up] <= cell):
            break
        keys[i], cells[i] = keys[up], cells[up]
        i = up
    keys[i], cells[i] = key, cell


@compiled
def _pop(keys: np.ndarray, cells: np.ndarray, size: int) -> int:
    """Takes the first cell from a heap of the given size."""
    first = cells[0]
    key, cell = keys[size - 1], cells[size - 1]
    i = 0
    while 2 * i + 1 < size - 1:
        down = 2 * i + 1
        right = down + 1
        if right < size - 1 and (
            keys[right] < keys[down] or (keys[right] == keys[down] and cells[right] < cells[down])
        ):
            down = right
        if key < keys[down] or (key == keys[down] and cell <= cells[down]):
            break
        keys[i], cells[i] = keys[down], cells[down]
        i = down
    keys[i], cells[i] = key, cell
    return first


@compiled
def a_star_action(truth: np.ndarray, stride: int, source: int, goal: int) -> int:
    """Gives the first action of A*'s path, 0 if there is none.

    Eight neighbours, Euclidean costs and heuristic, no check of corners; of entries with equal sums
    the cell that is first in row-major order is taken.

    Args:
        truth: free cells of the true arena, from :func:`forestrl.kernels.flood.pad`.
        stride: of the padded map.
        source: the agent's cell.
        goal: another cell.
    """
    steps = eight_steps(stride)
    spent = np.full(len(truth), np.inf)
    parent = np.full(len(truth), -1, np.int32)
    keys, cells = np.empty(_ROOM), np.empty(_ROOM, np.int32)  # grown where there is need
    goal_row, goal_col = goal // stride, goal % stride
    spent[source], size = 0.0, 1
    keys[0], cells[0] = 0.0, source
    while size > 0:
        cell = _pop(keys, cells, size)
        size -= 1
        if cell == goal:
            break
        for step in steps:
            near = cell + step
            if truth[near] != _FREE:
                continue
            new = spent[cell] + (1.0 if abs(step) == 1 or abs(step) == stride else np.sqrt(2.0))
            if new < spent[near]:
                spent[near], parent[near] = new, cell
                row, col = near // stride - goal_row, near % stride - goal_col
                if size == len(keys):
                    keys = np.concatenate((keys, np.empty(size)))
                    cells = np.concatenate((cells, np.empty(size, np.int32)))
                _push(keys, cells, size, new + np.sqrt(float(row * row + col * col)), near)
                size += 1
    if parent[goal] < 0:
        return 0
    while parent[goal] != source:
        goal = parent[goal]
    for i in range(len(steps)):
        if source + steps[i] == goal:
            return i + 1
    return 0
