"""What a source of worlds is: where an episode takes place, and where in it the robot starts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Protocol

import numpy as np
import torch
from torch import Tensor

from forestrl.envs.worlds.grid_map import GridMap
from forestrl.functional import Cell
from forestrl.settings import Range, checked

Side = Annotated[int, Range(3, 1000)]
ATTEMPTS = 8
"""Forests drawn before giving up on finding one with a free cell."""


class World(Protocol):
    """A source of worlds of one shape, for :class:`~forestrl.envs.ForestEnv`.

    A world in metres has a ``cell_size``, the side of a cell. One that knows more than which cells
    are occupied has a ``draw_map(generator)``, see :func:`draw_map`. One that rests on files or
    assumptions has a ``describe()`` that says so in one line; commands print it.
    """

    shape: tuple[int, int]
    """Rows and columns of every arena, cells."""

    def sample(
        self, batch: tuple[int, ...], *, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draws arenas with a start each.

        Args:
            batch: leading dimensions.
            generator: source of randomness; the results are on its device.

        Returns:
            occupied cells, bool ``[*batch, H, W]``, and the robot's cells, int64 ``[*batch, 2]``,
            each free.
        """


@checked
def arena_shape(shape: Side | tuple[Side, Side]) -> tuple[int, int]:
    """Gives rows and columns from either, or from the side of a square."""
    rows, columns = shape if isinstance(shape, Sequence) else (shape, shape)
    return rows, columns


def draw_map(
    world: World, generator: torch.Generator, cell_size: float = 1.0
) -> tuple[GridMap, Tensor]:
    """Draws the arena that ``world.sample((), generator=generator)`` would, as a map.

    Args:
        world: any source of worlds.
        generator: source of randomness.
        cell_size: side of a cell, metres, for a world that says nothing of it.

    Returns:
        the map and the robot's cell, int64 ``[2]``.
    """
    if (draw := getattr(world, "draw_map", None)) is not None:
        return draw(generator)
    trees, start = world.sample((), generator=generator)
    cells = np.where(trees.cpu().numpy(), np.uint8(Cell.OCCUPIED), np.uint8(Cell.FREE))
    return GridMap(cells, getattr(world, "cell_size", cell_size)), start


def sample_singly(
    draw: Callable[[torch.Generator], tuple[Tensor, Tensor]],
    batch: tuple[int, ...],
    *,
    shape: tuple[int, int],
    generator: torch.Generator,
) -> tuple[Tensor, Tensor]:
    """Fills a batch with arenas that are drawn one after the other.

    Args:
        draw: gives an arena, bool ``[H, W]``, and a cell, int64 ``[2]``.
        batch: leading dimensions.
        shape: rows and columns.
        generator: source of randomness; the results are on its device.

    Returns:
        bool ``[*batch, H, W]`` and int64 ``[*batch, 2]``.
    """
    count, device = math.prod(batch), generator.device
    trees = torch.empty(count, *shape, dtype=torch.bool, device=device)
    start = torch.empty(count, 2, dtype=torch.int64, device=device)
    for i in range(count):
        trees[i], start[i] = draw(generator)
    return trees.view(*batch, *shape), start.view(*batch, 2)
