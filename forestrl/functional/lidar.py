"""The LiDAR: 360 degrees, range ``l``, blocked by trunks along discrete lines; what it adds."""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor

from forestrl.functional.arena import coverage
from forestrl.functional.grid import Cell, gather, inside


class SightLines(NamedTuple):
    """The cells within range of the sensor and the cells that can hide them."""

    offsets: Tensor
    """(row, col) offsets of the cells within range, int64 ``[K, 2]``; the first is (0, 0)."""
    between: Tensor
    """Offsets strictly between the sensor and each of them, int64 ``[K, L, 2]``, filled up with
    (0, 0), the sensor's own cell, which never hides anything."""


def _round_half_away(numerator: int, denominator: int) -> int:
    magnitude = (2 * abs(numerator) + denominator) // (2 * denominator)
    return magnitude if numerator >= 0 else -magnitude


def sight_lines(lidar_range: float) -> SightLines:
    """Lists what a sensor of the given range can see, and through which cells.

    The line to offset (dr, dc) passes the cells at (round(i dr / n), round(i dc / n)) for
    i = 1 .. n-1 with ``n = max(|dr|, |dc|)``, halves rounded away from zero.

    Args:
        lidar_range: ``l``, cells; a cell is within range if its offset is not longer.

    Returns:
        the lines, shortest first.
    """
    reach = math.floor(lidar_range)
    span = range(-reach, reach + 1)
    offsets = [(r, c) for r in span for c in span if r * r + c * c <= lidar_range**2]
    offsets.sort(key=lambda o: (o[0] ** 2 + o[1] ** 2, o))
    between = torch.zeros(len(offsets), max(reach - 1, 1), 2, dtype=torch.int64)
    for line, (dr, dc) in zip(between, offsets, strict=True):
        n = max(abs(dr), abs(dc))
        for i in range(1, n):
            line[i - 1] = torch.tensor((_round_half_away(i * dr, n), _round_half_away(i * dc, n)))
    return SightLines(torch.tensor(offsets), between)


def scan(trees: Tensor, position: Tensor, lines: SightLines) -> Tensor:
    """Scans the arena from the agent's cell.

    A cell is seen if it is within range and no trunk lies strictly between; the trunk cells that
    are hit are seen.

    Args:
        trees: occupied cells, bool ``[*B, H, W]``.
        position: int64 ``[*B, 2]``.
        lines: from :func:`sight_lines`.

    Returns:
        the seen cells, bool ``[*B, H, W]``.
    """
    height, width = trees.shape[-2:]
    index = position.unsqueeze(-2) + lines.offsets.to(position.device)  # (*B, K, 2)
    passed = position[..., None, None, :] + lines.between.to(position.device)  # (*B, K, L, 2)
    hidden = gather(trees, passed.flatten(-3, -2), outside=False)
    hidden = hidden.unflatten(-1, lines.between.shape[:2]).any(-1)
    visible = inside(index, (height, width)) & ~hidden
    flat = index[..., 0].clamp(0, height - 1) * width + index[..., 1].clamp(0, width - 1)
    seen = torch.zeros_like(trees, dtype=torch.uint8).flatten(-2)
    seen.scatter_reduce_(-1, flat, visible.to(torch.uint8), "amax")
    return seen.bool().unflatten(-1, (height, width))


def reveal(
    trees: Tensor, cells: Tensor, position: Tensor, lines: SightLines
) -> tuple[Tensor, Tensor]:
    """Adds a scan to the agent's map: seen cells take their true state for ever.

    Args:
        trees: occupied cells, bool ``[*B, H, W]``.
        cells: the agent's map, uint8 ``[*B, H, W]``.
        position: int64 ``[*B, 2]``.
        lines: from :func:`sight_lines`.

    Returns:
        the new map, uint8 ``[*B, H, W]``, and the number of cells that became known, free and
        occupied, ``n^e``, float32 ``[*B, 1]``.
    """
    new = scan(trees, position, lines) & (cells == Cell.UNKNOWN)
    truth = torch.where(trees, int(Cell.OCCUPIED), int(Cell.FREE)).to(cells.dtype)
    return torch.where(new, truth, cells), new.flatten(-2).sum(-1, keepdim=True).float()


def sense(
    trees: Tensor, traversable: Tensor, cells: Tensor, position: Tensor, lines: SightLines
) -> tuple[Tensor, Tensor, Tensor]:
    """Scans, adds the scan to the agent's map, and gives the coverage reached.

    Args:
        trees: occupied cells, bool ``[*B, H, W]``.
        traversable: the free cells that can be reached from the start, bool ``[*B, H, W]``.
        cells: the agent's map, uint8 ``[*B, H, W]``; it is not changed.
        position: int64 ``[*B, 2]``.
        lines: from :func:`sight_lines`.

    Returns:
        the new map and ``n^e``, as from :func:`reveal`, and ``rho``, as from
        :func:`~forestrl.functional.coverage`.
    """
    cells, new_cells = reveal(trees, cells, position, lines)
    return cells, new_cells, coverage(cells, traversable)
