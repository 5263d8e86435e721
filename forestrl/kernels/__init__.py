"""Compiled CPU versions of the functions that look at whole maps at every step.

Each has the signature of the torch function of the same name in :mod:`forestrl.functional`, which
stays the reference, the version for other devices, and what the tests compare it with. Callers
import from here and get the fastest version for the tensors they pass.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from torch import Tensor

from forestrl import functional as F
from forestrl.kernels import graph, paths, sensing

R = TypeVar("R")


def _compiled(compiled: Callable[..., R], reference: Callable[..., R]) -> Callable[..., R]:
    """Takes the compiled version for CPU tensors and the reference for all others."""

    @wraps(reference)
    def choose(first: Tensor, *args: object, **kwargs: object) -> R:
        version = compiled if first.device.type == "cpu" else reference
        return version(first, *args, **kwargs)

    return choose


exploration_graph = _compiled(graph.exploration_graph, F.exploration_graph)
potential = _compiled(graph.potential, F.potential)
sense = _compiled(sensing.sense, F.sense)
component = _compiled(paths.component, F.component)
largest_component = _compiled(paths.largest_component, F.largest_component)
path_lengths = _compiled(paths.path_lengths, F.path_lengths)

__all__ = [
    "component",
    "exploration_graph",
    "largest_component",
    "path_lengths",
    "potential",
    "sense",
]
