"""The LiDAR and the coverage, compiled: a step looks at the cells in range and counts the map."""

from __future__ import annotations

import numpy as np
import torch
from numba import njit, prange
from torch import Tensor

from forestrl.functional import Cell, SightLines

_UNKNOWN, _FREE, _OCCUPIED = int(Cell.UNKNOWN), int(Cell.FREE), int(Cell.OCCUPIED)


@njit(cache=True, parallel=True)
def _reveal(
    trees: np.ndarray,
    cells: np.ndarray,
    position: np.ndarray,
    offsets: np.ndarray,
    between: np.ndarray,
    new_cells: np.ndarray,
) -> None:
    height, width = trees.shape[1:]
    for b in prange(len(trees)):
        row, col = position[b]
        new = 0
        for k in range(len(offsets)):
            r, c = row + offsets[k, 0], col + offsets[k, 1]
            if r < 0 or r >= height or c < 0 or c >= width or cells[b, r, c] != _UNKNOWN:
                continue
            hidden = False
            for i in range(between.shape[1]):
                hidden |= trees[b, row + between[k, i, 0], col + between[k, i, 1]]
            if not hidden:
                cells[b, r, c] = _OCCUPIED if trees[b, r, c] else _FREE
                new += 1
        new_cells[b] = new


def reveal(
    trees: Tensor, cells: Tensor, position: Tensor, lines: SightLines
) -> tuple[Tensor, Tensor]:
    """:func:`forestrl.functional.reveal`, compiled."""
    cells = cells.clone(memory_format=torch.contiguous_format)
    new_cells = torch.empty(*cells.shape[:-2], 1)
    _reveal(
        trees.reshape(-1, *trees.shape[-2:]).contiguous().numpy(),
        cells.view(-1, *cells.shape[-2:]).numpy(),
        position.reshape(-1, 2).contiguous().numpy(),
        lines.offsets.numpy(),
        lines.between.numpy(),
        new_cells.view(-1).numpy(),
    )
    return cells, new_cells


@njit(cache=True, parallel=True)
def _coverage(cells: np.ndarray, traversable: np.ndarray, out: np.ndarray) -> None:
    for b in prange(len(cells)):
        known = total = 0
        for i in range(cells.shape[1]):
            known += traversable[b, i] & (cells[b, i] == _FREE)
            total += traversable[b, i]
        out[b] = np.float32(known) / np.float32(total)


def coverage(cells: Tensor, traversable: Tensor) -> Tensor:
    """:func:`forestrl.functional.coverage`, compiled."""
    out = torch.empty(*cells.shape[:-2], 1)
    area = cells.shape[-2] * cells.shape[-1]
    _coverage(
        cells.reshape(-1, area).contiguous().numpy(),
        traversable.reshape(-1, area).contiguous().numpy(),
        out.view(-1).numpy(),
    )
    return out
