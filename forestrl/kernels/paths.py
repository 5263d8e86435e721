"""Flood fills, compiled: components and path lengths in time linear in the cells reached."""

from __future__ import annotations

import numpy as np
import torch
from numba import njit, prange
from torch import Tensor

from forestrl.functional import gather


@njit(cache=True)
def _flood(free: np.ndarray, lengths: np.ndarray, row: int, col: int, queue: np.ndarray) -> int:
    """Walks breadth-first from a cell and returns how many cells it reached.

    Writes the number of moves to each cell where ``lengths`` is negative; lists them in ``queue``.
    """
    height, width = free.shape
    queue[0] = row * width + col
    lengths[row, col] = 0
    head, tail = 0, 1
    while head < tail:
        r, c = queue[head] // width, queue[head] % width
        head += 1
        for near_r in range(max(r - 1, 0), min(r + 2, height)):
            for near_c in range(max(c - 1, 0), min(c + 2, width)):
                if free[near_r, near_c] and lengths[near_r, near_c] < 0:
                    lengths[near_r, near_c] = lengths[r, c] + 1
                    queue[tail] = near_r * width + near_c
                    tail += 1
    return tail


@njit(cache=True, parallel=True)
def _path_lengths(free: np.ndarray, source: np.ndarray, out: np.ndarray) -> None:
    height, width = free.shape[1:]
    for b in prange(len(free)):
        lengths = np.full((height, width), -1, np.int32)
        queue = np.empty(height * width, np.int64)
        for i in range(_flood(free[b], lengths, source[b, 0], source[b, 1], queue)):
            r, c = queue[i] // width, queue[i] % width
            out[b, r, c] = lengths[r, c]


@njit(cache=True, parallel=True)
def _largest_components(free: np.ndarray, out: np.ndarray) -> None:
    height, width = free.shape[1:]
    for b in prange(len(free)):
        lengths = np.full((height, width), -1, np.int32)
        queue = np.empty(height * width, np.int64)
        best_size, best_last, best_cell = 0, 0, -1
        for r in range(height):
            for c in range(width):
                if free[b, r, c] and lengths[r, c] < 0:
                    size = _flood(free[b], lengths, r, c, queue)
                    last = queue[:size].max()
                    if size > best_size or (size == best_size and last < best_last):
                        best_size, best_last, best_cell = size, last, r * width + c
        if best_size > 0:
            lengths[:] = -1
            size = _flood(free[b], lengths, best_cell // width, best_cell % width, queue)
            for i in range(size):
                out[b, queue[i] // width, queue[i] % width] = True


def path_lengths(free: Tensor, source: Tensor) -> Tensor:
    """:func:`forestrl.functional.path_lengths`, compiled."""
    grids = free.reshape(-1, *free.shape[-2:]).contiguous()
    out = torch.full(grids.shape, torch.inf)
    _path_lengths(grids.numpy(), source.reshape(-1, 2).contiguous().numpy(), out.numpy())
    return out.view(free.shape)


def component(free: Tensor, position: Tensor) -> Tensor:
    """:func:`forestrl.functional.component`, compiled."""
    starts_free = gather(free, position.unsqueeze(-2), outside=False).unsqueeze(-1)
    return path_lengths(free, position).isfinite() & free & starts_free


def largest_component(free: Tensor) -> Tensor:
    """:func:`forestrl.functional.largest_component`, compiled."""
    grids = free.reshape(-1, *free.shape[-2:]).contiguous()
    out = torch.zeros_like(grids)
    _largest_components(grids.numpy(), out.numpy())
    return out.view(free.shape)
