"""The exploration graph and the frontier potential, compiled: one pass over each arena's map."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from forestrl.functional import DISPLACEMENTS, FEATURES, WAYPOINTS, Cell, Graph
from forestrl.kernels.batches import grids, over_batch, rows
from forestrl.kernels.compiling import compiled

_DISPLACEMENTS = DISPLACEMENTS.numpy()
_UNKNOWN, _FREE = int(Cell.UNKNOWN), int(Cell.FREE)


@compiled(inline="always")
def _mark_frontier(cells: np.ndarray, frontier: np.ndarray) -> int:
    """Marks the frontier of a map and counts its cells."""
    height, width = cells.shape
    near = np.zeros(width + 2, np.uint8)  # unknown in this row or one beside it, by column + 1
    count = 0
    for r in range(height):
        above, below = max(r - 1, 0), min(r + 1, height - 1)
        for c in range(width):
            near[c + 1] = (
                (cells[above, c] == _UNKNOWN)
                | (cells[r, c] == _UNKNOWN)
                | (cells[below, c] == _UNKNOWN)
            )
        for c in range(width):
            frontier[r, c] = (cells[r, c] == _FREE) & (near[c] | near[c + 1] | near[c + 2])
        for c in range(width):
            count += frontier[r, c]
    return count


@compiled(inline="always")
def _window_counts(
    cells: np.ndarray, frontier: np.ndarray, row: int, col: int, reach: int
) -> tuple[int, int, int]:
    """Counts free, unknown and frontier cells in the window around a cell."""
    height, width = cells.shape
    free = unknown = border = 0
    for r in range(max(row - reach, 0), min(row + reach + 1, height)):
        for c in range(max(col - reach, 0), min(col + reach + 1, width)):
            free += cells[r, c] == _FREE
            unknown += cells[r, c] == _UNKNOWN
            border += frontier[r, c]
    return free, unknown, border


@compiled
def _sorted_frontier(frontier: np.ndarray, row: int, col: int, count: int) -> np.ndarray:
    """Lists the frontier's cells as row-major indices, nearest to (row, col) first."""
    height, width = frontier.shape
    order = np.empty(count, np.int64)
    n = 0
    for r in range(height):
        for c in range(width):
            if frontier[r, c]:
                square = (r - row) ** 2 + (c - col) ** 2
                order[n] = square * (height * width) + r * width + c
                n += 1
    order.sort()
    return order % (height * width)


@compiled(inline="always")
def _nearest_waypoint(row: int, col: int) -> tuple[int, np.int64]:
    """Finds the waypoint (1 to 8) nearest to an offset from the agent, and the square distance."""
    best, best_square = 0, np.int64(1) << 40
    for i in range(1, WAYPOINTS):
        square = (row - _DISPLACEMENTS[i, 0]) ** 2 + (col - _DISPLACEMENTS[i, 1]) ** 2
        if square < best_square:
            best, best_square = i, square
    return best, best_square


@compiled(inline="always")
def _write_counts(
    x: np.ndarray, cells: np.ndarray, frontier: np.ndarray, row: int, col: int, window: int
) -> None:
    """Writes the shares of free, unknown, occupied and frontier cells into a node's features."""
    area = window * window
    free, unknown, border = _window_counts(cells, frontier, row, col, window // 2)
    x[4] = np.float32(free) / area
    x[5] = np.float32(unknown) / area
    x[6] = np.float32(area - free - unknown) / area
    x[7] = np.float32(border) / area


@over_batch
def _graphs(
    first: int,
    last: int,
    cells: np.ndarray,
    position: np.ndarray,
    window: int,
    lidar_range: float,
    x: np.ndarray,
    waypoint: np.ndarray,
    length: np.ndarray,
    frontiers: np.ndarray,
) -> None:
    height, width = cells.shape[1:]
    for b in range(first, last):
        row, col = position[b]
        frontier = np.empty((height, width), np.uint8)
        count = _mark_frontier(cells[b], frontier)
        frontiers[b] = count
        x[b, 0, 0] = 1.0
        for i in range(WAYPOINTS):
            r, c = row + _DISPLACEMENTS[i, 0], col + _DISPLACEMENTS[i, 1]
            if i > 0:
                known = 0 <= r < height and 0 <= c < width
                x[b, i, 1 if known and cells[b, r, c] == _FREE else 2] = 1.0
            _write_counts(x[b, i], cells[b], frontier, r, c, window)
        listed = _sorted_frontier(frontier, row, col, count)
        for f in range(min(count, waypoint.shape[1])):
            r, c = listed[f] // width, listed[f] % width
            x[b, WAYPOINTS + f, 3] = 1.0
            _write_counts(x[b, WAYPOINTS + f], cells[b], frontier, r, c, window)
            nearest, square = _nearest_waypoint(r - row, c - col)
            waypoint[b, f] = nearest
            length[b, f] = np.sqrt(np.float32(square)) / np.float32(lidar_range)


def exploration_graph(
    cells: Tensor, position: Tensor, *, window: int, max_frontiers: int, lidar_range: float
) -> Graph:
    """:func:`forestrl.functional.exploration_graph`, compiled."""
    batch = cells.shape[:-2]
    count = batch.numel()
    x = torch.zeros(count, WAYPOINTS + max_frontiers, FEATURES)
    waypoint = torch.zeros(count, max_frontiers, dtype=torch.int64)
    length = torch.zeros(count, max_frontiers)
    frontiers = torch.empty(count, dtype=torch.int64)
    _graphs(
        grids(cells),
        rows(position),
        window,
        float(lidar_range),
        x.numpy(),
        waypoint.numpy(),
        length.numpy(),
        frontiers.numpy(),
    )
    return Graph(
        x.view(*batch, -1, FEATURES),
        waypoint.view(*batch, -1),
        length.view(*batch, -1),
        frontiers.view(*batch, 1),
    )


@over_batch
def _potentials(
    first: int,
    last: int,
    cells: np.ndarray,
    position: np.ndarray,
    window: int,
    beta: float,
    out: np.ndarray,
) -> None:
    height, width = cells.shape[1:]
    diagonal = np.sqrt((height - 1.0) ** 2 + (width - 1.0) ** 2)
    area = window * window
    for b in range(first, last):
        row, col = position[b]
        frontier = np.empty((height, width), np.uint8)
        _mark_frontier(cells[b], frontier)
        best = 0.0
        for r in range(height):
            for c in range(width):
                if frontier[r, c]:
                    _, unknown, _ = _window_counts(cells[b], frontier, r, c, window // 2)
                    distance = np.sqrt((r - row) ** 2.0 + (c - col) ** 2.0) / diagonal
                    best = max(best, (1 - distance + beta * unknown / area) / (1 + beta))
        out[b] = best


def potential(cells: Tensor, position: Tensor, *, window: int, beta: float) -> Tensor:
    """:func:`forestrl.functional.potential`, compiled."""
    out = torch.empty(cells.shape[:-2].numel())
    _potentials(grids(cells), rows(position), window, float(beta), out.numpy())
    return out.view(*cells.shape[:-2], 1)
