"""Components and path lengths, compiled: flood fills, in time linear in the cells reached."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from forestrl.functional import gather
from forestrl.kernels.batches import over_batch, rows
from forestrl.kernels.flood import PAD, UNREACHED, eight_steps, flood, no_lengths, pad, walk


@over_batch
def _path_lengths(
    first: int, last: int, cells: np.ndarray, source: np.ndarray, out: np.ndarray
) -> None:
    stride = cells.shape[2] + 2 * PAD
    for b in range(first, last):
        start = (source[b, 0] + PAD) * stride + source[b, 1] + PAD
        lengths, queue, reached = walk(pad(cells[b]), eight_steps(stride), start)
        for i in range(reached):
            out[b, queue[i] // stride - PAD, queue[i] % stride - PAD] = lengths[queue[i]]


@over_batch
def _largest_components(first: int, last: int, cells: np.ndarray, out: np.ndarray) -> None:
    stride = cells.shape[2] + 2 * PAD
    for b in range(first, last):
        grid, steps = pad(cells[b]), eight_steps(stride)
        lengths, queue = no_lengths(grid), np.empty(len(grid), np.int32)
        best_size, best_last, best_cell = 0, 0, -1
        for cell in range(len(grid)):
            if lengths[cell] == UNREACHED:
                lengths[cell], queue[0] = 0, cell
                _, size = flood(steps, lengths, queue, 0, 1, 0)
                last = queue[:size].max()
                if size > best_size or (size == best_size and last < best_last):
                    best_size, best_last, best_cell = size, last, cell
        if best_size > 0:
            _, queue, size = walk(grid, steps, best_cell)
            for i in range(size):
                out[b, queue[i] // stride - PAD, queue[i] % stride - PAD] = True


def path_lengths(free: Tensor, source: Tensor) -> Tensor:
    """:func:`forestrl.functional.path_lengths`, compiled."""
    grids = free.reshape(-1, *free.shape[-2:]).contiguous()
    out = torch.full(grids.shape, torch.inf)
    cells = grids.view(torch.uint8).numpy()  # a free cell is 1 in both
    _path_lengths(cells, rows(source), out.numpy())
    return out.view(free.shape)


def component(free: Tensor, position: Tensor) -> Tensor:
    """:func:`forestrl.functional.component`, compiled."""
    starts_free = gather(free, position.unsqueeze(-2), outside=False).unsqueeze(-1)
    return path_lengths(free, position).isfinite() & free & starts_free


def largest_component(free: Tensor) -> Tensor:
    """:func:`forestrl.functional.largest_component`, compiled."""
    grids = free.reshape(-1, *free.shape[-2:]).contiguous()
    out = torch.zeros_like(grids)
    _largest_components(grids.view(torch.uint8).numpy(), out.numpy())
    return out.view(free.shape)
