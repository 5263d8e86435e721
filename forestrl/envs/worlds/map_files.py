"""Worlds out of map files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from forestrl import functional as F
from forestrl.envs.worlds.grid_map import CellSize, Place, Point, RobotRadius
from forestrl.envs.worlds.map_server import Colour, Mode, Share, assumptions, map_files, read_map
from forestrl.envs.worlds.mapped import SHIPPED, MappedWorld, require_one_start
from forestrl.envs.worlds.source import Side
from forestrl.settings import Range, checked
from forestrl.wording import written


class MapFiles(MappedWorld):
    """Maps of ROS's map_server, or images: one, or a folder of them.

    Args:
        path: a YAML file, an image, or a folder; of a folder all YAML files and the images that
            belong to none, in the order of their names. None for the map that is shipped.
        reduce: side of the blocks of cells that become one cell.
        robot_radius: by which what is occupied grows, metres.
        size: rows and columns of the arenas, cells; None for those of the largest map.
        corner: x and y of the arenas' lower left corner, metres; None to draw it.
        start: x and y of the place where the robot starts, metres; None to draw it.
        start_cell: row and column of the cell where the robot starts, in place of ``start``.
        start_colour: red, green and blue of the pixels that mark the start, in place of both.
        resolution: metres of a pixel's side; None for what the YAML file says, as in those below.
        occupied_thresh: occupancy above which a cell is occupied.
        free_thresh: occupancy below which a cell is free.
        negate: whether white is occupied.
        mode: of map_server.

    Raises:
        OSError: if a file cannot be read.
        ValueError: if it holds something that is not allowed.
    """

    @checked
    def __init__(
        self,
        path: Path | None = None,
        reduce: Annotated[int, Range(1, 100)] = 4,
        robot_radius: RobotRadius = 0.0,
        size: Side | tuple[Side, Side] | None = None,
        corner: Point | None = None,
        start: Point | None = None,
        start_cell: Place | None = None,
        start_colour: tuple[Colour, Colour, Colour] | None = None,
        resolution: CellSize | None = None,
        occupied_thresh: Share | None = None,
        free_thresh: Share | None = None,
        negate: bool | None = None,
        mode: Mode | None = None,
    ) -> None:
        require_one_start(start=start, start_cell=start_cell, start_colour=start_colour)
        fields = {
            "resolution": resolution,
            "occupied_thresh": occupied_thresh,
            "free_thresh": free_thresh,
            "negate": negate,
            "mode": mode,
        }
        self.path, self.reduce, self.robot_radius = path, reduce, robot_radius
        self.given = {name: value for name, value in fields.items() if value is not None}
        files = map_files(SHIPPED / "maps" if path is None else Path(path))
        maps = [read_map(file, self.given, start_colour) for file in files]
        maps = [grid.inflated(robot_radius).reduced(reduce) for grid in maps]
        if start is not None:
            maps = [replace(grid, start=start) for grid in maps]
        self.assumed = next(filter(None, (assumptions(file, self.given) for file in files)), "")
        super().__init__(maps, size, corner, start_cell)

    def describe(self) -> str:
        """Says what was read, what was made of it, and what was assumed."""
        unknown = sum(int((grid.cells == F.Cell.UNKNOWN).sum()) for grid in self.maps)
        names = (
            self.maps[0].name if len(self.maps) == 1 else f"{len(self.maps)} maps in {self.path}"
        )
        parts = [
            f"{names}: arenas of {self.shape[0]} x {self.shape[1]} cells of {self.cell_size:g} m",
            f"blocks of {self.reduce} x {self.reduce} cells are one, occupied if any in it is"
            * (self.reduce > 1),
            f"what is occupied grows by {self.robot_radius:g} m" * (self.robot_radius > 0),
            f"{unknown} unknown cells count as occupied" * (unknown > 0),
            self.assumed,
        ]
        given = [f"{name}={written(value)}" for name, value in self.given.items()]
        parts.append(f"as given: {', '.join(given)}" if given else "")
        return "; ".join(filter(None, parts))
