"""The LiDAR and the coverage, compiled: all of a map's work while it is in the cache."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from forestrl.functional import Cell, SightLines
from forestrl.kernels.batches import over_batch, rows
from forestrl.kernels.compiling import compiled

_UNKNOWN, _FREE, _OCCUPIED = int(Cell.UNKNOWN), int(Cell.FREE), int(Cell.OCCUPIED)


@compiled
def _reveal(
    trees: np.ndarray, cells: np.ndarray, width: int, row: int, col: int, offsets: np.ndarray,
    between: np.ndarray,
) -> int:  # fmt: skip
    """Adds a scan to one map in place; returns how many cells became known."""
    height, new = len(cells) // width, 0
    for k in range(len(offsets)):
        r, c = row + offsets[k, 0], col + offsets[k, 1]
        if r < 0 or r >= height or c < 0 or c >= width or cells[r * width + c] != _UNKNOWN:
            continue
        hidden = False
        for i in range(between.shape[1]):
            hidden |= trees[(row + between[k, i, 0]) * width + col + between[k, i, 1]]
        if not hidden:
            cells[r * width + c] = _OCCUPIED if trees[r * width + c] else _FREE
            new += 1
    return new


@compiled
def _covered(cells: np.ndarray, traversable: np.ndarray) -> np.float32:
    """Gives the explored share of the traversable cells; 32-bit counters, so that it vectorises."""
    known, total = np.int32(0), np.int32(0)
    for i in range(len(cells)):
        known = np.int32(known + np.int32(traversable[i] & (cells[i] == _FREE)))
        total = np.int32(total + np.int32(traversable[i]))
    return np.float32(known) / np.float32(total) if total > 0 else np.float32(np.nan)


@over_batch
def _sense(
    first: int, last: int, trees: np.ndarray, traversable: np.ndarray, before: np.ndarray,
    width: int, position: np.ndarray, offsets: np.ndarray, between: np.ndarray, after: np.ndarray,
    new_cells: np.ndarray, covered: np.ndarray,
) -> None:  # fmt: skip
    """Works on maps row by row, ``[B, H * W]``; writes the last three arrays."""
    for b in range(first, last):
        for i in range(trees.shape[1]):  # as a loop it becomes one copy of memory
            after[b, i] = before[b, i]
        row, col = position[b]
        new_cells[b] = _reveal(trees[b], after[b], width, row, col, offsets, between)
        covered[b] = _covered(after[b], traversable[b])


def sense(
    trees: Tensor, traversable: Tensor, cells: Tensor, position: Tensor, lines: SightLines
) -> tuple[Tensor, Tensor, Tensor]:
    """:func:`forestrl.functional.sense`, compiled."""
    height, width = trees.shape[-2:]
    after = torch.from_numpy(np.empty(cells.shape, np.uint8))  # numpy asks for huge pages
    new_cells = torch.empty(*cells.shape[:-2], 1)
    covered = torch.empty_like(new_cells)
    _sense(
        trees.reshape(-1, height * width).contiguous().numpy(),
        traversable.reshape(-1, height * width).contiguous().numpy(),
        cells.reshape(-1, height * width).contiguous().numpy(),
        width,
        rows(position),
        lines.offsets.numpy(),
        lines.between.numpy(),
        after.view(-1, height * width).numpy(),
        new_cells.view(-1).numpy(),
        covered.view(-1).numpy(),
    )
    return after, new_cells, covered


def are_compiled() -> bool:
    """Tells whether an earlier process has left compiled code; else first uses take seconds."""
    return _sense.is_compiled()
