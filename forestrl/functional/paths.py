"""Path lengths through known free cells."""

from __future__ import annotations

import torch
from torch import Tensor

from forestrl.functional.arena import dilate


def path_lengths(free: Tensor, source: Tensor) -> Tensor:
    """Counts the moves from a cell to every cell, along 8-connected free cells.

    The source itself is at 0 whether it is free or not.

    Args:
        free: bool ``[*B, H, W]``.
        source: int64 ``[*B, 2]``.

    Returns:
        float32 ``[*B, H, W]``, in moves; infinite where no path leads.
    """
    reached = torch.zeros_like(free, memory_format=torch.contiguous_format)
    flat = (source[..., 0] * free.shape[-1] + source[..., 1]).unsqueeze(-1)
    reached.flatten(-2).scatter_(-1, flat, True)
    lengths = torch.full(free.shape, torch.inf, device=free.device).masked_fill(reached, 0.0)
    steps = 0
    while True:
        wave = dilate(reached) & free & ~reached
        if not wave.any():
            return lengths
        steps += 1
        lengths = lengths.masked_fill(wave, float(steps))
        reached |= wave
