"""Frontiers: the border between what is known to be free and what is unknown."""

from __future__ import annotations

import torch
from torch import Tensor

from forestrl.functional.arena import dilate
from forestrl.functional.grid import Cell


def frontier(cells: Tensor) -> Tensor:
    """Marks the frontier: known free cells with an unknown 8-neighbour inside the arena.

    Args:
        cells: the agent's map, uint8 ``[*B, H, W]``.

    Returns:
        bool ``[*B, H, W]``.
    """
    return (cells == Cell.FREE) & dilate(cells == Cell.UNKNOWN)


def nearest_first(mask: Tensor, position: Tensor, capacity: int) -> tuple[Tensor, Tensor]:
    """Lists marked cells by their Euclidean distance from the agent, ties in row-major order.

    Args:
        mask: bool ``[*B, H, W]``.
        position: int64 ``[*B, 2]``.
        capacity: length of the list; the nearest cells are kept.

    Returns:
        the cells, int64 ``[*B, capacity, 2]``, zeros past the last one; and how many cells are
        marked in all, int64 ``[*B]``, which may exceed the capacity.
    """
    height, width = mask.shape[-2:]
    row = torch.arange(height, device=mask.device).unsqueeze(-1)
    col = torch.arange(width, device=mask.device)
    square = (row - position[..., 0, None, None]) ** 2 + (col - position[..., 1, None, None]) ** 2
    order = square * (height * width) + row * width + col
    order = order.masked_fill(~mask, torch.iinfo(torch.int64).max).flatten(-2)
    taken = min(capacity, height * width)
    order = order.topk(taken, dim=-1, largest=False, sorted=True).values % (height * width)
    count = mask.flatten(-2).sum(-1)
    listed = torch.arange(taken, device=mask.device) < count.unsqueeze(-1)
    cells = torch.stack((order // width, order % width), -1).masked_fill(~listed.unsqueeze(-1), 0)
    return torch.nn.functional.pad(cells, (0, 0, 0, capacity - taken)), count
