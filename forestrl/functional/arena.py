"""Arenas: sampling trunks and starts, connected components, and coverage."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from forestrl.functional.grid import Cell, inside


def sample_trees(
    batch: Sequence[int],
    *,
    shape: tuple[int, int],
    n_trees: int,
    tree_radius: tuple[float, float],
    generator: torch.Generator,
) -> Tensor:
    """Samples forests: trunk centres uniform in the arena, radii uniform in ``r_t``.

    Args:
        batch: leading dimensions ``*B``.
        shape: rows and columns of the arena, cells; the paper's are both ``h``.
        n_trees: number of trunks ``n_t``; trunks may overlap.
        tree_radius: smallest and largest radius ``r_t``, cells.
        generator: source of randomness; its device is the result's.

    Returns:
        occupied cells, bool ``[*batch, H, W]``.
    """
    draws = torch.rand(*batch, n_trees, 3, generator=generator, device=generator.device)
    low, high = tree_radius
    centre = draws[..., :2] * torch.tensor(shape, device=generator.device)
    return rasterize(centre, low + (high - low) * draws[..., 2], shape=shape)


def rasterize(
    centre: Tensor, radius: Tensor, *, shape: tuple[int, int], touching: bool = False
) -> Tensor:
    """Marks the cells whose centre lies within a trunk, its rim included.

    Args:
        centre: trunk centres, float ``[*B, n, 2]``, in cells; cell (i, j) spans [i, i+1).
        radius: float ``[*B, n]``, in cells.
        shape: rows and columns of the arena, cells.
        touching: mark every cell that a trunk touches, so that none is too thin to be there.

    Returns:
        bool ``[*B, H, W]``.
    """
    area, width = shape[0] * shape[1], shape[1]
    occupied = torch.zeros(*radius.shape[:-1], area, dtype=torch.uint8, device=radius.device)
    if radius.numel() == 0:
        return occupied.bool().unflatten(-1, shape)
    reach = math.ceil(float(radius.max()) + 0.5)
    span = torch.arange(-reach, reach + 1, device=radius.device)
    patch = torch.cartesian_prod(span, span)  # (P, 2), the cells a trunk can touch
    index = centre.floor().long().unsqueeze(-2) + patch  # (*B, n, P, 2)
    offset = index + 0.5 - centre.unsqueeze(-2)
    if touching:  # to the nearest point of the cell, not to its centre
        offset = (offset.abs() - 0.5).clamp(min=0)
    distance = offset.square().sum(-1).sqrt()
    hit = (distance <= radius.unsqueeze(-1)) & inside(index, shape)
    flat = (index[..., 0] * width + index[..., 1]).clamp(0, area - 1)
    occupied.scatter_reduce_(-1, flat.flatten(-2), hit.flatten(-2).to(torch.uint8), "amax")
    return occupied.bool().unflatten(-1, shape)


def dilate(mask: Tensor) -> Tensor:
    """Marks every cell that is marked or has a marked 8-neighbour: bool ``[*B, H, W]``."""
    rows = mask.clone()
    rows[..., 1:, :] |= mask[..., :-1, :]
    rows[..., :-1, :] |= mask[..., 1:, :]
    out = rows.clone()
    out[..., 1:] |= rows[..., :-1]
    out[..., :-1] |= rows[..., 1:]
    return out


def component(free: Tensor, position: Tensor) -> Tensor:
    """Gives the 8-connected component of free cells that holds a cell.

    Args:
        free: bool ``[*B, H, W]``.
        position: int64 ``[*B, 2]``; where this cell is not free, the component is empty.

    Returns:
        bool ``[*B, H, W]``.
    """
    reached = torch.zeros_like(free, memory_format=torch.contiguous_format)
    flat = (position[..., 0] * free.shape[-1] + position[..., 1]).unsqueeze(-1)
    reached.flatten(-2).scatter_(-1, flat, True)
    reached &= free
    while True:
        grown = dilate(reached) & free
        if torch.equal(grown, reached):
            return grown
        reached = grown


def largest_component(free: Tensor) -> Tensor:
    """Gives the largest 8-connected component of the free cells.

    Of two equally large components it is the one whose last cell in row-major order comes first.

    Args:
        free: bool ``[*B, H, W]``.

    Returns:
        bool ``[*B, H, W]``; empty where nothing is free.
    """
    height, width = free.shape[-2:]
    order = torch.arange(1, height * width + 1, device=free.device, dtype=torch.float32)
    label = order.view(height, width) * free  # ends as the last cell of the component, from 1
    while True:
        grown = torch.nn.functional.max_pool2d(label.view(-1, 1, height, width), 3, 1, 1)
        grown = grown.view_as(label) * free
        if torch.equal(grown, label):
            break
        label = grown
    flat = label.flatten(-2).long()
    size = torch.zeros(*flat.shape[:-1], height * width + 1, dtype=torch.int64, device=free.device)
    size.scatter_add_(-1, flat, free.flatten(-2).long())
    return (label == size.argmax(-1)[..., None, None]) & free


def sample_position(mask: Tensor, generator: torch.Generator) -> Tensor:
    """Draws a marked cell uniformly.

    Args:
        mask: bool ``[*B, H, W]``, with a marked cell in every grid.
        generator: source of randomness.

    Returns:
        int64 ``[*B, 2]``.
    """
    weight = mask.reshape(-1, mask.shape[-2] * mask.shape[-1]).float()
    flat = torch.multinomial(weight, 1, generator=generator).view(mask.shape[:-2])
    return torch.stack((flat // mask.shape[-1], flat % mask.shape[-1]), -1)


def coverage(cells: Tensor, traversable: Tensor) -> Tensor:
    """Gives the explored share of the traversable cells, ``rho``.

    Args:
        cells: the agent's map, uint8 ``[*B, H, W]``.
        traversable: the free cells that can be reached from the start, bool ``[*B, H, W]``.

    Returns:
        float32 ``[*B, 1]``.
    """
    known = ((cells == Cell.FREE) & traversable).flatten(-2).sum(-1, keepdim=True)
    return known.float() / traversable.flatten(-2).sum(-1, keepdim=True)
