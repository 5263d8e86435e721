"""Grids of cells: what a cell can be, reading cells by index, and counting cells in windows."""

from __future__ import annotations

from enum import IntEnum

import torch
from torch import Tensor


class Cell(IntEnum):
    """What the agent knows of a cell."""

    UNKNOWN = 0
    FREE = 1
    OCCUPIED = 2


def inside(index: Tensor, size: tuple[int, int]) -> Tensor:
    """Tells which cells lie in the arena.

    Args:
        index: (row, col) pairs, int64 ``[..., 2]``.
        size: rows and columns of the arena.

    Returns:
        bool ``[...]``.
    """
    row, col = index.unbind(-1)
    return (row >= 0) & (row < size[0]) & (col >= 0) & (col < size[1])


def gather(grid: Tensor, index: Tensor, outside: float) -> Tensor:
    """Reads cells, with a value for the cells outside the arena.

    Args:
        grid: ``[*B, H, W]``.
        index: (row, col) pairs, int64 ``[*B, K, 2]``.
        outside: the value of every cell outside the arena.

    Returns:
        ``[*B, K]``, of the grid's dtype.

    Examples:
        >>> gather(torch.eye(3), torch.tensor([[1, 1], [0, 2], [-1, 0]]), outside=7).tolist()
        [1.0, 0.0, 7.0]
    """
    height, width = grid.shape[-2:]
    row, col = index.unbind(-1)
    flat = row.clamp(0, height - 1) * width + col.clamp(0, width - 1)
    value = grid.flatten(-2).gather(-1, flat)
    return value.masked_fill(~inside(index, (height, width)), outside)


def window_counts_at(mask: Tensor, index: Tensor, window: int) -> Tensor:
    """Counts the marked cells in the ``k x k`` window around the given cells.

    A summed-area table (two cumulative sums) gives each count by four look-ups. Cells outside
    the arena are not marked; a window may be centred outside the arena.

    Args:
        mask: bool ``[*B, H, W]``.
        index: centres of the windows, int64 ``[*B, K, 2]``.
        window: ``k``, odd.

    Returns:
        int32 ``[*B, K]``.
    """
    height, width = mask.shape[-2:]
    table = mask.to(torch.int32).cumsum(-1, dtype=torch.int32).cumsum(-2, dtype=torch.int32)
    table = torch.nn.functional.pad(table, (1, 0, 1, 0)).flatten(-2)
    low, high = index - window // 2, index + window // 2 + 1
    top, bottom = low[..., 0].clamp(0, height), high[..., 0].clamp(0, height)
    left, right = low[..., 1].clamp(0, width), high[..., 1].clamp(0, width)

    def corner(row: Tensor, col: Tensor) -> Tensor:
        return table.gather(-1, row * (width + 1) + col)

    return corner(bottom, right) - corner(top, right) - corner(bottom, left) + corner(top, left)


def window_counts(mask: Tensor, window: int) -> Tensor:
    """Counts the marked cells in the ``k x k`` window around every cell.

    Args:
        mask: bool ``[*B, H, W]``.
        window: ``k``, odd.

    Returns:
        int32 ``[*B, H, W]``; cells outside the arena are not marked.

    Examples:
        >>> window_counts(torch.eye(3, dtype=torch.bool), window=3).tolist()
        [[2, 2, 1], [2, 3, 2], [1, 2, 2]]
    """
    height, width = mask.shape[-2:]
    index = all_cells((height, width), mask.device).expand(*mask.shape[:-2], -1, 2)
    return window_counts_at(mask, index, window).unflatten(-1, (height, width))


def all_cells(size: tuple[int, int], device: torch.device | str | None = None) -> Tensor:
    """Lists every cell in row-major order: int64 ``[H * W, 2]``."""
    row = torch.arange(size[0], device=device).repeat_interleave(size[1])
    col = torch.arange(size[1], device=device).repeat(size[0])
    return torch.stack((row, col), -1)
