"""Forests by the number of trunks on a hectare: scattered, kept apart, or planted in rows."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Annotated

import torch
from scipy.spatial import KDTree
from torch import Tensor

from forestrl import functional as F
from forestrl import kernels
from forestrl.envs.worlds.grid_map import CellSize, RobotRadius
from forestrl.envs.worlds.source import ATTEMPTS, Side, arena_shape, sample_singly
from forestrl.settings import Range, checked, not_allowed

HECTARE = 10_000  # square metres
Distance = Annotated[float, Range(above=0, high=1000)]
Diameter = Annotated[float, Range(above=0, high=1000)]
Density = Annotated[float, Range(0, 1_000_000)]


class MeasuredForest(ABC):
    """Forests in metres; what a kind of forest says is where the trunks stand.

    A cell is occupied if any part of a trunk, grown by the robot's radius, lies in it; trunks that
    stand outside reach into the arena. The start is a free cell drawn uniformly from the largest
    8-connected component of free cells. A forest without a free cell is drawn again.

    Args:
        shape: rows and columns, cells; one number for a square arena.
        cell_size: side of a cell, metres.
        dbh: smallest and largest diameter of a trunk, centimetres; uniform in between.
        robot_radius: by which each trunk grows, metres.
    """

    def __init__(
        self,
        shape: int | tuple[int, int],
        cell_size: float,
        dbh: tuple[float, float],
        robot_radius: float,
    ) -> None:
        if dbh[0] > dbh[1]:
            raise not_allowed("dbh", dbh, "it must be [smallest, largest]")
        self.shape, self.cell_size, self.robot_radius = arena_shape(shape), cell_size, robot_radius
        self.dbh = dbh[0], dbh[1]

    @abstractmethod
    def places(self, sides: tuple[float, float], generator: torch.Generator) -> Tensor:
        """Draws where trunks stand on a rectangle, metres: float ``[n, 2]``, along its sides."""

    @abstractmethod
    def describe(self) -> str:
        """Says how the trunks stand, and on what."""

    def sample(
        self, batch: tuple[int, ...], *, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draws forests and starts, see :class:`~forestrl.envs.World`.

        Raises:
            ValueError: if no forest with a free cell turns up.
        """
        return sample_singly(self._draw, batch, shape=self.shape, generator=generator)

    def _draw(self, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        for _ in range(ATTEMPTS):
            trees = self._trees(generator)
            if not trees.all():
                return trees, F.sample_position(kernels.largest_component(~trees), generator)
        raise ValueError(f"{self.describe()}: no cell is free; take fewer or thinner trunks")

    def _trees(self, generator: torch.Generator) -> Tensor:
        margin = self.dbh[1] / 200 + self.robot_radius  # how far a trunk outside reaches in
        rows, columns = (side * self.cell_size + 2 * margin for side in self.shape)
        places = self.places((rows, columns), generator)
        low, high = self.dbh
        draws = torch.rand(len(places), generator=generator, device=generator.device)
        radius = (low + (high - low) * draws) / 200 + self.robot_radius
        centre = (places - margin) / self.cell_size
        return F.rasterize(centre, radius / self.cell_size, shape=self.shape, touching=True)

    def _ground(self) -> str:
        rows, columns = self.shape
        return (
            f"dbh {self.dbh[0]:g} to {self.dbh[1]:g} cm; {rows} x {columns} cells of "
            f"{self.cell_size:g} m, occupied where a trunk, with {self.robot_radius:g} m around "
            "it, touches them"
        )


class PoissonForest(MeasuredForest):
    """Trunks anywhere, each regardless of the others: a Poisson process.

    Args:
        shape: rows and columns, cells; one number for a square arena.
        density: mean number of trunks on a hectare.
        cell_size: side of a cell, metres.
        dbh: smallest and largest diameter of a trunk, centimetres.
        robot_radius: by which each trunk grows, metres.

    Examples:
        >>> forest = PoissonForest((20, 30), density=500)
        >>> forest.sample((4,), generator=torch.Generator())[0].shape
        torch.Size([4, 20, 30])
    """

    @checked
    def __init__(
        self,
        shape: Side | tuple[Side, Side] = 50,
        density: Density = 800.0,
        cell_size: CellSize = 0.5,
        dbh: tuple[Diameter, Diameter] = (10.0, 60.0),
        robot_radius: RobotRadius = 0.25,
    ) -> None:
        super().__init__(shape, cell_size, dbh, robot_radius)
        self.density = density

    def places(self, sides: tuple[float, float], generator: torch.Generator) -> Tensor:
        """Draws where trunks stand, see :class:`MeasuredForest`."""
        return poisson_points(self.density / HECTARE, sides, generator)

    def describe(self) -> str:
        """Says how the trunks stand, and on what."""
        return f"{self.density:g} trunks a hectare on average, anywhere, {self._ground()}"


class HardCoreForest(MeasuredForest):
    """Trunks that keep their distance: a Matérn process of the second kind.

    Points come one after the other, anywhere; those stay that have no earlier point near them.

    Args:
        shape: rows and columns, cells; one number for a square arena.
        density: mean number of trunks on a hectare.
        distance: least distance between the middles of two trunks, metres.
        cell_size: side of a cell, metres.
        dbh: smallest and largest diameter of a trunk, centimetres.
        robot_radius: by which each trunk grows, metres.

    Raises:
        ValueError: if so many trunks cannot keep the distance.
    """

    @checked
    def __init__(
        self,
        shape: Side | tuple[Side, Side] = 50,
        density: Density = 800.0,
        distance: Distance = 1.5,
        cell_size: CellSize = 0.5,
        dbh: tuple[Diameter, Diameter] = (10.0, 60.0),
        robot_radius: RobotRadius = 0.25,
    ) -> None:
        super().__init__(shape, cell_size, dbh, robot_radius)
        self.density, self.distance = density, distance
        around = math.pi * distance**2
        share = density / HECTARE * around
        if share > 0.95:
            most = math.floor(0.95 * HECTARE / around)
            reason = f"it must be at most {most} for trunks {distance:g} m apart"
            raise not_allowed("density", density, reason)
        self._before = -math.log1p(-share) / around  # points a square metre, of which some stay

    def places(self, sides: tuple[float, float], generator: torch.Generator) -> Tensor:
        """Draws where trunks stand, see :class:`MeasuredForest`."""
        rows, columns = (side + 2 * self.distance for side in sides)  # neighbours from outside
        points = poisson_points(self._before, (rows, columns), generator)
        stays = torch.ones(len(points), dtype=torch.bool, device=points.device)
        pairs = KDTree(points.cpu().numpy()).query_pairs(self.distance, output_type="ndarray")
        stays[torch.from_numpy(pairs[:, 1]).to(points.device)] = False  # the later one of each
        points = points[stays] - self.distance
        inside = (points >= 0) & (points <= torch.tensor(sides, device=points.device))
        return points[inside.all(-1)]

    def describe(self) -> str:
        """Says how the trunks stand, and on what."""
        how = f"at least {self.distance:g} m apart"
        return f"{self.density:g} trunks a hectare on average, {how}, {self._ground()}"


class Plantation(MeasuredForest):
    """Trunks planted in rows, which run along the arena's rows from a place drawn uniformly.

    Args:
        shape: rows and columns, cells; one number for a square arena.
        spacing: between rows, and in a row from trunk to trunk, metres.
        jitter: by how much a trunk is off at most, along and across the row, metres.
        cell_size: side of a cell, metres.
        dbh: smallest and largest diameter of a trunk, centimetres.
        robot_radius: by which each trunk grows, metres.
    """

    @checked
    def __init__(
        self,
        shape: Side | tuple[Side, Side] = 50,
        spacing: tuple[Distance, Distance] = (4.0, 2.5),
        jitter: Annotated[float, Range(0, 1000)] = 0.3,
        cell_size: CellSize = 0.5,
        dbh: tuple[Diameter, Diameter] = (20.0, 40.0),
        robot_radius: RobotRadius = 0.25,
    ) -> None:
        super().__init__(shape, cell_size, dbh, robot_radius)
        self.spacing, self.jitter = (spacing[0], spacing[1]), jitter

    def places(self, sides: tuple[float, float], generator: torch.Generator) -> Tensor:
        """Draws where trunks stand, see :class:`MeasuredForest`."""
        device = generator.device
        first = torch.rand(2, generator=generator, device=device) * torch.tensor(self.spacing)
        lines = [
            torch.arange(
                math.floor(-self.jitter / gap) - 1, math.ceil((side + self.jitter) / gap) + 1
            )
            for side, gap in zip(sides, self.spacing, strict=True)
        ]
        places = first + torch.cartesian_prod(*lines).to(device) * torch.tensor(self.spacing)
        off = 2 * torch.rand(places.shape, generator=generator, device=device) - 1
        return places + self.jitter * off

    def describe(self) -> str:
        """Says how the trunks stand, and on what."""
        density = HECTARE / math.prod(self.spacing)
        rows = f"in rows {self.spacing[0]:g} m apart, every {self.spacing[1]:g} m"
        return f"{density:.0f} trunks a hectare {rows}, {self.jitter:g} m off, {self._ground()}"


def poisson_points(rate: float, sides: tuple[float, float], generator: torch.Generator) -> Tensor:
    """Draws points of a Poisson process on a rectangle.

    Args:
        rate: mean number of points a unit of area.
        sides: of the rectangle, from 0.
        generator: source of randomness.

    Returns:
        float32 ``[n, 2]``, in the order in which they came.
    """
    extent = torch.tensor(sides, device=generator.device)
    count = int(torch.poisson(rate * extent.prod(), generator=generator))
    return torch.rand(count, 2, generator=generator, device=generator.device) * extent
