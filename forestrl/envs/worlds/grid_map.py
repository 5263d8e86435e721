"""Maps of cells that lie somewhere in metres: what files of ROS's map_server hold."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy import ndimage

from forestrl.functional import Cell
from forestrl.settings import Range

CellSize = Annotated[float, Range(above=0, high=1000)]
RobotRadius = Annotated[float, Range(0, 100)]
Point = tuple[float, float]
Place = tuple[Annotated[int, Range(0)], Annotated[int, Range(0)]]
_EDGE = 1e-9  # cells: a point on an edge is in the cell above or to the right of it


@dataclass(frozen=True, eq=False)
class GridMap:
    """A piece of the world in cells, and where it lies.

    The first row is that with the largest y, as in a picture.

    Attributes:
        cells: uint8 ``[H, W]``, of :class:`~forestrl.functional.Cell`.
        cell_size: side of a cell, metres.
        origin: x and y of the lower left corner, metres, and the angle by which the map is turned
            about it, counter-clockwise, radians.
        start: x and y of the place where the robot starts, metres; None where it is not fixed.
        name: what messages call it, such as its file.
    """

    cells: np.ndarray
    cell_size: float
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start: Point | None = None
    name: str = "the map"

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.cells.shape[0], self.cells.shape[1]

    @property
    def free(self) -> np.ndarray:
        """The cells that are known to be free, bool ``[H, W]``."""
        return self.cells == Cell.FREE

    def cell_at(self, point: Point) -> tuple[int, int]:
        """Gives row and column of the cell at a point in metres; it may lie outside."""
        x, y = point[0] - self.origin[0], point[1] - self.origin[1]
        cos, sin = math.cos(self.origin[2]), math.sin(self.origin[2])
        along, up = (x * cos + y * sin) / self.cell_size, (y * cos - x * sin) / self.cell_size
        return self.shape[0] - 1 - math.floor(up + _EDGE), math.floor(along + _EDGE)

    def point_at(self, row: float, col: float) -> Point:
        """Gives x and y, metres, of the centre of a cell; of other points for fractions of cells.

        >>> GridMap(np.zeros((2, 3), np.uint8), 0.5, (1.0, -1.0, 0.0)).point_at(1, 0)
        (1.25, -0.75)
        """
        along, up = (col + 0.5) * self.cell_size, (self.shape[0] - row - 0.5) * self.cell_size
        cos, sin = math.cos(self.origin[2]), math.sin(self.origin[2])
        return self.origin[0] + along * cos - up * sin, self.origin[1] + along * sin + up * cos

    def reduced(self, factor: int) -> GridMap:
        """Gives the map in coarser cells: nothing that is occupied is lost.

        A block is occupied if any cell in it is, else unknown if any is unknown, else free. Blocks
        are counted from the lower left corner; what lacks in the last ones is unknown.

        Args:
            factor: side of a block, cells.
        """
        height, width = (math.ceil(side / factor) for side in self.shape)
        whole = self.padded((height * factor, width * factor)).cells
        blocks = whole.reshape(height, factor, width, factor)
        occupied = (blocks == Cell.OCCUPIED).any((1, 3))
        free = (blocks == Cell.FREE).all((1, 3))
        cells = np.select([occupied, free], [Cell.OCCUPIED, Cell.FREE], Cell.UNKNOWN)
        return replace(self, cells=cells.astype(np.uint8), cell_size=self.cell_size * factor)

    def inflated(self, radius: float) -> GridMap:
        """Gives the map of where the centre of a round robot may be.

        A free cell becomes occupied if any part of an occupied one is so near to its centre.

        Args:
            radius: of the robot, metres.
        """
        reach = math.ceil(radius / self.cell_size + 0.5)
        gap = np.maximum(np.abs(np.arange(-reach, reach + 1)) - 0.5, 0) * self.cell_size
        disc = np.hypot(gap[:, None], gap) <= radius
        near = ndimage.binary_dilation(self.cells == Cell.OCCUPIED, disc)
        cells = np.where(self.free & near, np.uint8(Cell.OCCUPIED), self.cells)
        return replace(self, cells=cells)

    def padded(self, shape: tuple[int, int]) -> GridMap:
        """Gives a map of at least this shape: the cells added above and to the right are unknown.

        Args:
            shape: rows and columns.
        """
        rows, columns = (max(0, want - have) for want, have in zip(shape, self.shape, strict=True))
        cells = np.pad(self.cells, ((rows, 0), (0, columns)), constant_values=int(Cell.UNKNOWN))
        return replace(self, cells=cells)

    def window(self, row: int, col: int, shape: tuple[int, int]) -> GridMap:
        """Gives a part of the map.

        Args:
            row: its first row.
            col: its first column.
            shape: its rows and columns.
        """
        cells = self.cells[row : row + shape[0], col : col + shape[1]]
        corner = self.point_at(row + shape[0] - 0.5, col - 0.5)
        return replace(self, cells=cells, origin=(*corner, self.origin[2]))
