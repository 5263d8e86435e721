"""Measured forests: where each trunk stands, and how thick it is."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from forestrl import functional as F
from forestrl.envs.worlds.grid_map import CellSize, GridMap, Place, Point, RobotRadius
from forestrl.envs.worlds.mapped import SHIPPED, MappedWorld, require_one_start
from forestrl.envs.worlds.refusals import wrong_field
from forestrl.envs.worlds.source import Side
from forestrl.settings import checked

COLUMNS = ("x_m", "y_m", "dbh_cm")
_MOST_CELLS = 25_000_000
_THICKEST = 0.1  # share of the ground that trunks may take; the densest forests have some 0.03


class Stems(NamedTuple):
    """The trunks of a plot."""

    place: np.ndarray
    """x and y, metres, float64 ``[n, 2]``."""
    radius: np.ndarray
    """Metres, float64 ``[n]``."""


def read_stems(path: Path) -> Stems:
    """Reads a stem plot.

    Args:
        path: a CSV file with the columns ``x_m``, ``y_m``, metres, and ``dbh_cm``, the diameter at
            breast height, centimetres. It may have others.

    Raises:
        OSError: if the file cannot be read.
        ValueError: if a column or a number is not there or makes no sense.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such file")
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            if lacking := [name for name in COLUMNS if name not in (reader.fieldnames or ())]:
                reason = f"{lacking[0]} must be one of them"
                raise wrong_field(path, "columns", reader.fieldnames or [], reason)
            rows = [
                [_number(path, reader.line_num, row, name) for name in COLUMNS] for row in reader
            ]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path} is not CSV: {error}") from error
    if not rows:
        raise ValueError(f"{path}: there are no stems in it")
    table = np.array(rows)
    stems = Stems(table[:, :2], table[:, 2] / 200)
    _check_units(path, stems)
    return stems


def stem_map(stems: Stems, cell_size: float, robot_radius: float = 0.0, name: str = "") -> GridMap:
    """Lays the box around the stems out in cells: those that any trunk touches are occupied.

    Args:
        stems: the trunks.
        cell_size: side of a cell, metres.
        robot_radius: by which each trunk grows, metres.
        name: what messages call the map.
    """
    corner, sides = stems.place.min(0), np.ptp(stems.place, 0)
    if np.prod(sides / cell_size) > _MOST_CELLS:
        reason = (
            f"{sides[0]:g} x {sides[1]:g} m around the stems must be {_MOST_CELLS:_} cells at most"
        )
        raise wrong_field(name, "metres of a cell", cell_size, reason)
    width, height = np.maximum(1, np.ceil(sides / cell_size)).astype(int).tolist()
    along, up = ((stems.place - corner) / cell_size).T
    centre = torch.from_numpy(np.stack((height - up, along), -1))
    radius = torch.from_numpy((stems.radius + robot_radius) / cell_size)
    trees = F.rasterize(centre, radius, shape=(height, width), touching=True).numpy()
    cells = np.where(trees, np.uint8(F.Cell.OCCUPIED), np.uint8(F.Cell.FREE))
    return GridMap(cells, cell_size, (float(corner[0]), float(corner[1]), 0.0), name=name)


class StemPlot(MappedWorld):
    """A measured forest, or parts of it.

    Args:
        path: a CSV file with ``x_m``, ``y_m`` and ``dbh_cm``; None for the plot that is shipped.
        cell_size: side of a cell, metres.
        robot_radius: by which each trunk grows, metres.
        size: rows and columns of the arenas, cells; None for the whole plot.
        corner: x and y of the arenas' lower left corner, metres; None to draw it.
        start: x and y of the place where the robot starts, metres; None to draw it.
        start_cell: row and column of the cell where the robot starts, in place of ``start``.

    Raises:
        OSError: if the file cannot be read.
        ValueError: if it holds something that is not allowed.
    """

    @checked
    def __init__(
        self,
        path: Path | None = None,
        cell_size: CellSize = 0.5,
        robot_radius: RobotRadius = 0.25,
        size: Side | tuple[Side, Side] | None = 50,
        corner: Point | None = None,
        start: Point | None = None,
        start_cell: Place | None = None,
    ) -> None:
        require_one_start(start=start, start_cell=start_cell)
        self.path = SHIPPED / "stems" / "mount_rainier_AV06.csv" if path is None else Path(path)
        self.robot_radius, self.stems = robot_radius, read_stems(self.path)
        plot = stem_map(self.stems, cell_size, robot_radius, name=str(self.path))
        super().__init__([replace(plot, start=start)], size, corner, start_cell)

    def describe(self) -> str:
        """Says what was read, what was made of it, and what was assumed."""
        width, height = np.ptp(self.stems.place, 0)
        return (
            f"{self.path}: {len(self.stems.radius)} trunks on {width:.1f} x {height:.1f} m, the "
            f"box around them; arenas of {self.shape[0]} x {self.shape[1]} cells of "
            f"{self.cell_size:g} m, occupied where a trunk, with {self.robot_radius:g} m around "
            "it, touches them"
        )


def _number(path: Path, line: int, row: dict[str, str | None], name: str) -> float:
    """Reads a number out of a row."""
    try:
        number = float(row[name] or "")
    except ValueError:
        number = math.nan
    if not math.isfinite(number) or (name == "dbh_cm" and number <= 0):
        reason = f"it must be a number{' more than 0' if name == 'dbh_cm' else ''}"
        raise wrong_field(f"{path}: line {line}", name, row[name], reason)
    return number


def _check_units(path: Path, stems: Stems) -> None:
    """Refuses trunks that are too thick or too thin for centimetres."""
    sides, thickest = np.ptp(stems.place, 0), float(stems.radius.max())
    ground = np.pi * np.square(stems.radius).sum()
    if 2 * thickest >= sides.min() or ground > _THICKEST * sides.prod():
        reason = (
            f"such trunks fill {ground:.3g} m² of a plot of {sides[0]:.3g} x {sides[1]:.3g} m: x_m "
            "and y_m must be in metres, dbh_cm in centimetres"
        )
        raise wrong_field(path, "dbh_cm", round(200 * thickest, 3), reason)
    if 200 * thickest < 1:
        reason = "no trunk is thicker: it must be in centimetres"
        raise wrong_field(path, "dbh_cm", round(200 * thickest, 3), reason)
