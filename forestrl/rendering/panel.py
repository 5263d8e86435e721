"""Coloured cells to draw on, and the colours."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

# After Okabe and Ito, for readers who see few colours; waypoints differ in shape as well.
INK, PAPER, FAINT, PALE = (38, 38, 38), (255, 255, 255), (128, 128, 128), (200, 200, 200)
GROUND, TRUNK = (243, 239, 230), (84, 68, 54)
UNKNOWN, FREE, OCCUPIED = (206, 206, 206), (255, 255, 255), (60, 60, 60)
SOLID = (150, 150, 150)  # what is occupied, at large
VEILED = (166, 156, 146)  # a trunk that is unknown yet
AGENT, FRONTIER = (0, 114, 178), (230, 159, 0)
INTERVENTION, COLLISION = (190, 60, 140), (178, 24, 43)
EDGE = (140, 140, 140)
FEASIBLE, INFEASIBLE = (0, 158, 115), COLLISION

Colour = tuple[int, ...]
"""Red, green and blue, 0 to 255, and maybe opacity."""
Point = Sequence[float]
"""(row, col) in cells; integers are the centres of cells."""

_FINE = 3  # drawn this much larger and then reduced, for smooth lines


class Panel:
    """Coloured cells to draw on in cell coordinates, (row, col).

    Args:
        colours: of the cells, uint8 ``[h, w, 3]``.
        scale: side of a cell, pixels.
    """

    def __init__(self, colours: NDArray[np.uint8], scale: int) -> None:
        self.unit = scale * _FINE
        self._scale = scale
        self._enlarge(Image.fromarray(colours), self.unit)

    def _enlarge(self, image: Image.Image, factor: int) -> None:
        size = (image.width * factor, image.height * factor)
        self.image = image.resize(size, Image.Resampling.NEAREST)
        self.pen = ImageDraw.Draw(self.image, "RGBA")  # blends translucent colours

    def finished(self) -> Image.Image:
        """Gives the picture in its final size."""
        return self.image.reduce(_FINE)

    def line(self, points: Sequence[Point], colour: Colour, width: float) -> None:
        """Draws a line through points, ``width`` pixels thick."""
        xy = [self._xy(point) for point in points]
        self.pen.line(xy, fill=colour, width=self._thick(width), joint="curve")

    def hairlines(self, pairs: Sequence[tuple[Point, Point]], colour: Colour) -> None:
        """Draws lines of one pixel and one colour: many of them stay light, and small in a GIF."""
        image = self.finished()
        pen = ImageDraw.Draw(image)
        for pair in pairs:
            pen.line(
                [((col + 0.5) * self._scale, (row + 0.5) * self._scale) for row, col in pair],
                fill=colour,
            )
        self._enlarge(image, _FINE)

    def square(self, point: Point, colour: Colour) -> None:
        """Fills a cell."""
        (x, y), r = self._xy(point), self.unit / 2
        self.pen.rectangle((x - r, y - r, x + r - 1, y + r - 1), fill=colour)

    def circle(
        self,
        point: Point,
        radius: float,
        *,
        fill: Colour | None = None,
        outline: Colour | None = None,
        width: float = 1.0,
    ) -> None:
        """Draws a circle; ``radius`` in cells, ``width`` in pixels."""
        (x, y), r = self._xy(point), radius * self.unit
        box = (x - r, y - r, x + r, y + r)
        self.pen.ellipse(box, fill=fill, outline=outline, width=self._thick(width))

    def diamond(self, point: Point, radius: float, colour: Colour) -> None:
        """Draws a filled diamond; ``radius`` in cells."""
        (x, y), r = self._xy(point), radius * self.unit
        self.pen.polygon([(x - r, y), (x, y - r), (x + r, y), (x, y + r)], fill=colour)

    def star(self, point: Point, radius: float, colour: Colour) -> None:
        """Draws a filled star of five points; ``radius`` in cells."""
        (x, y), r = self._xy(point), radius * self.unit
        corners = [(r if i % 2 == 0 else 0.42 * r, math.pi * i / 5) for i in range(10)]
        xy = [(x + far * math.sin(turn), y - far * math.cos(turn)) for far, turn in corners]
        self.pen.polygon(xy, fill=colour)

    def border(self, point: Point, colour: Colour, width: float) -> None:
        """Draws the border of a cell, on its inside, ``width`` pixels thick."""
        (x, y), r = self._xy(point), self.unit / 2
        box = (x - r, y - r, x + r - 1, y + r - 1)
        self.pen.rectangle(box, outline=colour, width=self._thick(width))

    def waypoint(self, point: Point, *, feasible: bool, radius: float = 0.36) -> None:
        """Draws a green circle or a red cross; ``radius`` in cells."""
        width = max(1.0, self.unit / _FINE / 16)
        if feasible:
            self.circle(point, radius, outline=FEASIBLE, width=width)
            return
        (row, col), r = point, 0.8 * radius
        self.line([(row - r, col - r), (row + r, col + r)], INFEASIBLE, width)
        self.line([(row - r, col + r), (row + r, col - r)], INFEASIBLE, width)

    def _xy(self, point: Point) -> tuple[float, float]:
        return (point[1] + 0.5) * self.unit, (point[0] + 0.5) * self.unit

    def _thick(self, width: float) -> int:
        return max(1, round(width * _FINE))


def colours_of(cells: NDArray[np.integer], palette: Sequence[Colour]) -> NDArray[np.uint8]:
    """Gives every cell the colour that its value numbers: uint8 ``[h, w, 3]``."""
    return np.array(palette, dtype=np.uint8)[cells]
