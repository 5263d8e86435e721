"""Compiled CPU versions of the functions that look at whole maps at every step.

Each has the signature of the torch function of the same name in :mod:`forestrl.functional`, which
stays the reference, the version for other devices, and what the tests compare it with. Callers
import from here and get the fastest version for the tensors they pass.
"""

from __future__ import annotations

from forestrl import functional as F
from forestrl.kernels import graph, paths, sensing
from forestrl.kernels.dispatch import by_device

exploration_graph = by_device(graph.exploration_graph, F.exploration_graph)
potential = by_device(graph.potential, F.potential)
sense = by_device(sensing.sense, F.sense)
component = by_device(paths.component, F.component)
largest_component = by_device(paths.largest_component, F.largest_component)
path_lengths = by_device(paths.path_lengths, F.path_lengths)

__all__ = [
    "component",
    "exploration_graph",
    "largest_component",
    "path_lengths",
    "potential",
    "sense",
]
