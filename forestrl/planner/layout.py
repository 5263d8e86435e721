"""Where the cells of a plan lie: between metres, the cells of a grid, and the planner's own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from forestrl.functional import Cell
from forestrl.planner.grid import Grid
from forestrl.planner.masks import coarse

Place = tuple[int, int]
"""(row, col) of a cell."""


@dataclass(frozen=True)
class Layout:
    """The lattice that the planner's cells lie on, and the part of it that the map shows.

    The lattice is tied to the frame of the map, not to the grid: a grid that grows or shifts by
    whole cells leaves every cell where it was.
    """

    side: float
    """Of a cell, metres."""
    yaw: float
    """Of the lattice in the frame of the map, radians."""
    first: Place
    """Number of the first row and column on the lattice."""
    rest: tuple[float, float]
    """What the lattice is off the frame's own zero, (rows, cols), less than a cell."""
    shape: tuple[int, int]
    """Rows and columns."""

    @staticmethod
    def from_text(text: Mapping[str, Any]) -> Layout:
        """Reads what ``dataclasses.asdict`` gives, after a way through JSON."""
        lists = {name: tuple(text[name]) for name in ("first", "rest", "shape")}
        return Layout(text["side"], text["yaw"], **lists)

    def place(self, x: float, y: float) -> Place | None:
        """Finds the cell of a point; None if it is not on the map."""
        found = self.places(np.array([[x, y]]))
        return (int(found[0, 0]), int(found[0, 1])) if len(found) else None

    def places(self, points: np.ndarray) -> np.ndarray:
        """Finds the cells of those points that are on the map.

        Args:
            points: (x, y) in metres, float64 ``[n, 2]``.

        Returns:
            (row, col), int64 ``[k, 2]``.
        """
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        x, y = points[:, 0], points[:, 1]
        u, v = cos * x + sin * y, cos * y - sin * x
        off = np.array(self.first) + np.array(self.rest)
        cells = np.floor(np.stack((v, u), 1) / self.side - off + 1e-9)
        inside = ((cells >= 0) & (cells < np.array(self.shape))).all(1)
        return cells[inside].astype(np.int64)

    def point(self, place: Place) -> tuple[float, float]:
        """Gives the centre of a cell, metres."""
        return self.points(np.array([place]))[0]

    def points(self, places: np.ndarray) -> list[tuple[float, float]]:
        """Gives the centres of cells ``[n, 2]``, metres."""
        v = (places[:, 0] + 0.5 + self.first[0] + self.rest[0]) * self.side
        u = (places[:, 1] + 0.5 + self.first[1] + self.rest[1]) * self.side
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        x, y = cos * u - sin * v, sin * u + cos * v
        return list(zip(x.tolist(), y.tolist(), strict=True))

    def centres(self) -> np.ndarray:
        """Gives the centres of all cells, metres, float64 ``[H * W, 2]``."""
        return np.array(self.points(np.indices(self.shape).reshape(2, -1).T))


def fine_layout(grid: Grid) -> Layout:
    """Gives the layout of a grid's own cells."""
    x, y, yaw = grid.origin
    cos, sin = math.cos(yaw), math.sin(yaw)
    row, col = (cos * y - sin * x) / grid.resolution, (cos * x + sin * y) / grid.resolution
    first = (math.floor(row + 1e-6), math.floor(col + 1e-6))
    rest = (row - first[0], col - first[1])
    height, width = grid.data.shape
    return Layout(grid.resolution, yaw, first, rest, (height, width))


def laid_out(cells: np.ndarray, fine: Layout, factor: int, edge: int) -> tuple[np.ndarray, Layout]:
    """Joins the cells of a grid into larger ones, and puts unknown cells around it.

    A joined cell is occupied if any of its cells is, else unknown if any is; its place depends on
    the lattice, not on where the grid begins.

    Args:
        cells: ``Cell`` values, uint8 ``[h, w]``.
        fine: their layout.
        factor: how many cells become one along a side.
        edge: unknown cells to put around, joined ones.

    Returns:
        cells, uint8 ``[H, W]``, and their layout.
    """
    before = tuple(number % factor for number in fine.first)
    after = tuple(
        -(number + size) % factor for number, size in zip(fine.first, fine.shape, strict=True)
    )
    if factor > 1:
        pads = tuple(zip(before, after, strict=True))
        cells = coarse(np.pad(cells, pads, constant_values=int(Cell.UNKNOWN)), factor)
    cells = np.pad(cells, edge, constant_values=int(Cell.UNKNOWN))
    first = tuple(
        (number - off) // factor - edge for number, off in zip(fine.first, before, strict=True)
    )
    rest = (fine.rest[0] / factor, fine.rest[1] / factor)
    shape = (cells.shape[0], cells.shape[1])
    return cells, Layout(fine.side * factor, fine.yaw, (first[0], first[1]), rest, shape)
