"""How compiled code runs: loops over a batch, on as many threads as torch uses."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import update_wrapper
from pathlib import Path
from typing import Any

import numpy as np
import torch

from forestrl.kernels.compiling import compiled

_PER_THREAD = 16  # maps that are worth starting a thread for


class over_batch:  # noqa: N801 - a decorator
    """Compiles a loop over a batch: ``function(first, last, *arrays)`` handles rows first to last.

    The compiled function is called with the arrays alone; the length of the first is the batch.
    Rows must not depend on one another. Large batches are shared out over as many threads as torch
    is set to use; numba's own threads, which a process cannot be forked with, are never started.

    Args:
        function: the loop, in the part of Python that numba compiles.
    """

    def __init__(self, function: Callable[..., None]) -> None:
        self.compiled = compiled(function, nogil=True)
        update_wrapper(self, function)

    def __call__(self, *arrays: Any) -> None:
        """Runs the loop over the whole batch."""
        rows = len(arrays[0])
        parts = max(1, min(torch.get_num_threads(), rows // _PER_THREAD))
        if parts == 1:
            self.compiled(0, rows, *arrays)
            return
        ends = [rows * part // parts for part in range(parts + 1)]
        with ThreadPoolExecutor(parts - 1) as pool:
            pieces = itertools.pairwise(ends[1:])
            others = [pool.submit(self.compiled, *piece, *arrays) for piece in pieces]
            self.compiled(0, ends[1], *arrays)
            for other in others:
                other.result()

    def is_compiled(self) -> bool:
        """Tells whether an earlier process has left the compiled code; else first uses take longer.

        Whether it is of this source and for this processor is not looked at.
        """
        stats = getattr(self.compiled, "stats", None)
        if stats is None:  # numba was told not to compile
            return True
        module = Path(self.compiled.py_func.__code__.co_filename).stem
        return any(Path(stats.cache_path).glob(f"{module}.*.nbi"))


def grids(tensor: torch.Tensor) -> np.ndarray:
    """Gives maps ``[*B, H, W]`` as one contiguous array ``[b, H, W]``."""
    return tensor.detach().reshape(-1, *tensor.shape[-2:]).contiguous().numpy()


def rows(tensor: torch.Tensor) -> np.ndarray:
    """Gives positions ``[*B, 2]`` as one contiguous array ``[b, 2]``."""
    return tensor.detach().reshape(-1, 2).contiguous().numpy()
