"""What a robot's map becomes for planning: cells too close, too few, or not to be gone to.

All of it works on ``Cell`` values, uint8 ``[H, W]``, and writes occupied cells only: nothing
becomes free that the map does not show free.
"""

from __future__ import annotations

import numpy as np

from forestrl.functional import Cell
from forestrl.kernels.compiling import compiled

_UNKNOWN, _FREE, _OCCUPIED = int(Cell.UNKNOWN), int(Cell.FREE), int(Cell.OCCUPIED)


def cells_of(data: np.ndarray, free_at_most: int, occupied_at_least: int) -> np.ndarray:
    """Reads occupancy in per cent as cells; what lies between the thresholds is unknown.

    >>> cells_of(np.array([[-1, 0, 50, 100]]), 25, 65).tolist()
    [[0, 1, 0, 2]]
    """
    cells = np.full(data.shape, _UNKNOWN, np.uint8)
    cells[(data >= 0) & (data <= free_at_most)] = _FREE
    cells[data >= occupied_at_least] = _OCCUPIED
    return cells


@compiled
def coarse(cells: np.ndarray, factor: int) -> np.ndarray:
    """Joins ``factor`` x ``factor`` cells: occupied if any is, else unknown if any is.

    Args:
        cells: with sides that the factor divides.
        factor: how many cells become one along a side.
    """
    height, width = cells.shape[0] // factor, cells.shape[1] // factor
    joined = np.empty((height, width), np.uint8)
    for r in range(height):
        for c in range(width):
            unknown = occupied = False
            for i in range(r * factor, (r + 1) * factor):
                for j in range(c * factor, (c + 1) * factor):
                    unknown |= cells[i, j] == _UNKNOWN
                    occupied |= cells[i, j] == _OCCUPIED
            joined[r, c] = _OCCUPIED if occupied else _UNKNOWN if unknown else _FREE
    return joined


@compiled
def inflate(cells: np.ndarray, radius: float) -> np.ndarray:
    """Marks the free cells from whose centre an occupied cell is nearer than the robot's radius.

    Args:
        cells: the map.
        radius: of the robot, cells.
    """
    height, width = cells.shape
    grown, reach = cells.copy(), int(radius + 0.5)
    for r in range(height):
        for c in range(width):
            if cells[r, c] != _OCCUPIED:
                continue
            for i in range(max(r - reach, 0), min(r + reach + 1, height)):
                for j in range(max(c - reach, 0), min(c + reach + 1, width)):
                    down, along = max(abs(i - r) - 0.5, 0.0), max(abs(j - c) - 0.5, 0.0)
                    if grown[i, j] == _FREE and down * down + along * along < radius * radius:
                        grown[i, j] = _OCCUPIED
    return grown


@compiled
def _beside_free(cells: np.ndarray, r: int, c: int) -> bool:
    height, width = cells.shape
    for i in range(max(r - 1, 0), min(r + 2, height)):
        for j in range(max(c - 1, 0), min(c + 2, width)):
            if cells[i, j] == _FREE:
                return True
    return False


@compiled
def seal_specks(cells: np.ndarray, least: int) -> None:
    """Occupies unknown cells beside free ones that hang together with too few of their kind.

    Args:
        cells: the map; written.
        least: how many 8-connected ones are worth going to.
    """
    height, width = cells.shape
    edge = np.zeros(cells.shape, np.bool_)
    for r in range(height):
        for c in range(width):
            edge[r, c] = cells[r, c] == _UNKNOWN and _beside_free(cells, r, c)
    queue = np.empty((height * width, 2), np.int32)
    for r in range(height):
        for c in range(width):
            if not edge[r, c]:
                continue
            edge[r, c], queue[0, 0], queue[0, 1] = False, r, c
            head, tail = 0, 1
            while head < tail:
                row, col = queue[head]
                head += 1
                for i in range(max(row - 1, 0), min(row + 2, height)):
                    for j in range(max(col - 1, 0), min(col + 2, width)):
                        if edge[i, j]:
                            edge[i, j], queue[tail, 0], queue[tail, 1] = False, i, j
                            tail += 1
            if tail < least:
                for k in range(tail):
                    cells[queue[k, 0], queue[k, 1]] = _OCCUPIED


@compiled
def seal_beside(cells: np.ndarray, visited: np.ndarray) -> None:
    """Occupies the unknown cells beside those where the robot has been: its sensor missed them.

    Args:
        cells: the map; written.
        visited: (row, col), int64 ``[n, 2]``; they need not lie on the map.
    """
    height, width = cells.shape
    for k in range(len(visited)):
        row, col = visited[k]
        for r in range(max(row - 1, 0), min(row + 2, height)):
            for c in range(max(col - 1, 0), min(col + 2, width)):
                if cells[r, c] == _UNKNOWN:
                    cells[r, c] = _OCCUPIED


@compiled
def seal_around(cells: np.ndarray, goals: np.ndarray, radius: float, row: int, col: int) -> None:
    """Occupies what lies around goals that were set aside, but not where the robot is.

    Args:
        cells: the map; written.
        goals: (row, col), int64 ``[n, 2]``; they need not lie on the map.
        radius: cells. Free cells nearer to a goal than the robot, less one and a half cells, are
            occupied: a robot within the radius can still leave.
        row: the robot's.
        col: the robot's.
    """
    height, width = cells.shape
    reach = int(radius)
    for k in range(len(goals)):
        y, x = goals[k]
        limit = np.sqrt(float((y - row) ** 2 + (x - col) ** 2)) - 1.5
        for r in range(max(y - reach, 0), min(y + reach + 1, height)):
            for c in range(max(x - reach, 0), min(x + reach + 1, width)):
                far = np.sqrt(float((r - y) ** 2 + (c - x) ** 2))
                if far <= radius and (cells[r, c] == _UNKNOWN or far < limit):
                    cells[r, c] = _OCCUPIED


@compiled
def in_polygon(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Tells which points lie in a polygon, by the parity of its edges to the right of each.

    Args:
        points: (x, y), float64 ``[n, 2]``.
        polygon: its corners in order, float64 ``[m, 2]``.

    Returns:
        bool ``[n]``.
    """
    inside = np.zeros(len(points), np.bool_)
    for k in range(len(points)):
        x, y = points[k]
        j = len(polygon) - 1
        for i in range(len(polygon)):
            (x1, y1), (x2, y2) = polygon[i], polygon[j]
            if (y1 > y) != (y2 > y) and x < (x2 - x1) * (y - y1) / (y2 - y1) + x1:
                inside[k] = not inside[k]
            j = i
    return inside
