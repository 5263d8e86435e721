"""The sensor's lines of sight as bits: one bit for each cell within range.

The cells within range of a viewpoint are packed row by row into 64-bit words, with one bit to spare
in every row. To see the bits of a neighbouring viewpoint from here is then to shift them: what
leaves the range on the side falls on a spare bit, which is never set at home.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.extending import intrinsic

from forestrl.functional import DISPLACEMENTS, sight_lines

WORD = 64


class Sight(NamedTuple):
    """Lines of sight for flat maps of one stride; ``K`` cells are within range."""

    lidar_range: float
    """``l``, cells."""
    margin: int
    """Cells of obstacle that a flat map must have around the arena."""
    steps: np.ndarray
    """Differences of cell number to the eight neighbours, int64 ``[8]``."""
    shifts: np.ndarray
    """By how many bits those steps shift what is seen, int64 ``[8]``."""
    offsets: np.ndarray
    """Differences of cell number to the cells within range, int64 ``[K]``, shortest first."""
    between: np.ndarray
    """The same for the cells that can hide each of them, int64 ``[K, L]``; 0 hides nothing."""
    bits: np.ndarray
    """Each cell within range as a bit, uint64 ``[K, words]``."""
    hides: np.ndarray
    """The cells that each of them hides if it is occupied, uint64 ``[K, words]``."""


@lru_cache(maxsize=16)
def sight(lidar_range: float, width: int) -> Sight:
    """Makes the lines of sight of a sensor in arenas of a width.

    Args:
        lidar_range: ``l``, cells.
        width: columns of the arena.

    Returns:
        the lines as numbers of cells and as bits.
    """
    lines = sight_lines(lidar_range)
    offsets, between = lines.offsets.numpy(), lines.between.numpy()
    margin = max(int(np.floor(lidar_range)), 2)
    stride = width + 2 * margin
    pitch = 2 * int(np.floor(lidar_range)) + 2  # bits of a row, one of them to spare
    place = offsets @ np.array([pitch, 1])
    place -= place.min()
    words = int(place.max()) // WORD + 1
    bits = np.zeros((len(offsets), words), np.uint64)
    for k, p in enumerate(place):
        bits[k, p // WORD] = np.uint64(1) << np.uint64(p % WORD)
    hides = np.zeros_like(bits)
    number = {tuple(offset): k for k, offset in enumerate(offsets)}
    for k, line in enumerate(between):
        for cell in {tuple(cell) for cell in line} - {(0, 0)}:
            hides[number[cell]] |= bits[k]
    moves = DISPLACEMENTS[1:].numpy()
    flat = np.array([stride, 1])
    return Sight(
        float(lidar_range),
        margin,
        moves @ flat,
        moves @ np.array([pitch, 1]),
        offsets @ flat,
        between @ flat,
        bits,
        hides,
    )


@intrinsic
def popcount(typing_context, word) -> Any:  # noqa: ANN001
    """Counts the bits that are set in a 64-bit word."""

    def build(context, builder, signature, args):  # noqa: ANN001, ANN202
        value = context.cast(builder, args[0], signature.args[0], types.uint64)
        return builder.ctpop(value)

    return types.int64(word), build
