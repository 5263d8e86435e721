"""Worlds that are maps, or parts of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from forestrl import functional as F
from forestrl import kernels
from forestrl.envs.worlds.grid_map import GridMap, Point
from forestrl.envs.worlds.refusals import wrong_field
from forestrl.envs.worlds.source import Side, arena_shape, sample_singly
from forestrl.settings import allows, describe, not_allowed
from forestrl.wording import written

SHIPPED = Path(__file__).parent / "assets"
"""Real worlds that are part of the package."""


class MappedWorld:
    """Arenas that are maps or windows of maps, in metres.

    A cell that is unknown in the map is not traversable, hides what is behind it from the LiDAR,
    and is never seen as free: it counts as occupied. Exported, it is unknown again.

    Where a map says nothing of it, the robot starts in a free cell drawn uniformly from the largest
    8-connected component of free cells in the arena.

    Args:
        maps: all of one cell size; each arena is one of them, drawn uniformly.
        size: rows and columns of the arenas, cells; None for those of the largest map. Smaller maps
            are surrounded by unknown cells.
        corner: x and y of the arenas' lower left corner, metres; None to draw it uniformly among
            those of arenas with at least half as many free cells as the one with the most.
        start_cell: row and column of the cell where the robot starts, in place of the maps' own.

    Raises:
        ValueError: if an arena or a start is not in the map, or is not free.

    Examples:
        >>> cells = np.full((20, 30), F.Cell.FREE, np.uint8)
        >>> world = MappedWorld([GridMap(cells, cell_size=0.5)], size=12)
        >>> world.sample((4,), generator=torch.Generator())[0].shape
        torch.Size([4, 12, 12])
    """

    def __init__(
        self,
        maps: Sequence[GridMap],
        size: int | tuple[int, int] | None = None,
        corner: Point | None = None,
        start_cell: tuple[int, int] | None = None,
    ) -> None:
        self.shape = _largest(maps) if size is None else arena_shape(size)
        self.cell_size, self.start_cell = maps[0].cell_size, start_cell
        for grid in maps:
            if not math.isclose(grid.cell_size, self.cell_size):
                reason = f"{maps[0].name} has cells of {self.cell_size:g} m, and all must be alike"
                raise wrong_field(grid.name, "metres of a cell", grid.cell_size, reason)
        self.maps = [grid.padded(self.shape) for grid in maps]
        self._corners = [_corners(grid, self.shape, corner) for grid in self.maps]
        self._check_starts()

    def sample(
        self, batch: tuple[int, ...], *, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draws arenas and starts, see :class:`~forestrl.envs.World`."""

        def draw(generator: torch.Generator) -> tuple[Tensor, Tensor]:
            grid, start = self.draw_map(generator)
            return torch.from_numpy(~grid.free), start

        return sample_singly(draw, batch, shape=self.shape, generator=generator)

    def draw_map(self, generator: torch.Generator) -> tuple[GridMap, Tensor]:
        """Draws an arena with its unknown cells and its place in the world.

        Args:
            generator: source of randomness.

        Returns:
            the map and the robot's cell, int64 ``[2]``.
        """
        chosen = _draw(len(self.maps), generator)
        corners = self._corners[chosen]
        row, col = corners[_draw(len(corners), generator)].tolist()
        grid = self.maps[chosen].window(row, col, self.shape)
        if (cell := self._start(grid)) is not None:
            return grid, torch.tensor(cell, device=generator.device)
        free = torch.from_numpy(grid.free).to(generator.device)
        return grid, F.sample_position(kernels.largest_component(free), generator)

    def _start(self, grid: GridMap) -> tuple[int, int] | None:
        if self.start_cell is not None:
            return self.start_cell
        return None if grid.start is None else grid.cell_at(grid.start)

    def _check_starts(self) -> None:
        """Refuses fixed starts that are not free in every arena that may be drawn."""
        for grid, corners in zip(self.maps, self._corners, strict=True):
            if grid.start is None and self.start_cell is None:
                continue
            name = "start" if self.start_cell is None else "start_cell"
            given = self.start_cell or tuple(round(number, 6) for number in grid.start or ())
            if len(corners) > 1:
                reason = "it needs the whole map, or an arena that corner fixes"
                raise not_allowed(name, given, reason)
            first_row, first_col = corners[0].tolist()
            arena = grid.window(first_row, first_col, self.shape)
            row, col = self._start(arena) or (0, 0)
            inside = 0 <= row < self.shape[0] and 0 <= col < self.shape[1]
            state = F.Cell(int(arena.cells[row, col])).name.lower() if inside else "outside"
            if state != "free":
                place = f"cell [{row},{col}] of {written(self.shape)} in {grid.name}"
                raise not_allowed(name, given, f"it must be free, and {place} is {state}")


def require_one_start(**starts: Any) -> None:
    """Refuses a start that is given in two ways.

    Raises:
        ValueError: naming both.
    """
    given = [name for name, value in starts.items() if value is not None]
    if len(given) > 1:
        raise not_allowed(given[1], starts[given[1]], f"{given[0]} is given too, and one is enough")


def _draw(count: int, generator: torch.Generator) -> int:
    return int(torch.randint(count, (), generator=generator, device=generator.device))


def _largest(maps: Sequence[GridMap]) -> tuple[int, int]:
    """Gives the shape that holds each of the maps."""
    rows, columns = map(max, zip(*(grid.shape for grid in maps), strict=True))
    if not allows(tuple[Side, Side], (rows, columns)):
        reason = (
            f"they must be {describe(Side)} on each side: read another number of them as one, or "
            "take a part of the map by size"
        )
        raise wrong_field(maps[0].name, "cells", (rows, columns), reason)
    return rows, columns


def _corners(grid: GridMap, shape: tuple[int, int], corner: Point | None) -> np.ndarray:
    """Lists where an arena may begin, as enough in it is free: first row and column, ``[n, 2]``."""
    last = [have - want for have, want in zip(grid.shape, shape, strict=True)]
    corners = np.argwhere(np.ones([side + 1 for side in last]))
    if corner is not None:
        row, col = grid.cell_at(corner)
        row -= shape[0] - 1
        if not (0 <= row <= last[0] and 0 <= col <= last[1]):
            reason = f"an arena of {written(shape)} cells from there is not inside {grid.name}"
            raise not_allowed("corner", corner, reason)
        corners = np.array([[row, col]])
    counts = np.pad(grid.free.cumsum(0).cumsum(1), ((1, 0), (1, 0)))  # a summed-area table
    (top, left), (bottom, right) = corners.T, corners.T + np.array(shape)[:, None]
    free = counts[bottom, right] - counts[top, right] - counts[bottom, left] + counts[top, left]
    if not free.any():
        raise ValueError(f"{grid.name}: no cell is free in an arena of {written(shape)} cells")
    return corners[2 * free >= free.max()]
