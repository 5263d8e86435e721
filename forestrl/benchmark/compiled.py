"""Each compiled function against the reference that it stands for, in turns."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

from tensordict import TensorDict

from forestrl import functional as F
from forestrl import kernels
from forestrl.benchmark.report import to_csv
from forestrl.benchmark.run import Forests, Makers
from forestrl.benchmark.timing import measure
from forestrl.policies.gatv2 import GATv2Encoder
from forestrl.storage import atomic_write

GRAPHS = 16
"""Graphs of a minibatch (Table III)."""
ENCODER = "GATv2 forward + backward"
_BETA = 0.5
Call = Callable[[], object]


@dataclass(frozen=True)
class Gain:
    """What compiling a function gains.

    Attributes:
        function: its name in :mod:`forestrl.functional`, or that of the encoder's two passes.
        size: arena side, cells.
        batch: maps or graphs a call works on.
        compiled: median time of one of them, seconds.
        reference: that of the reference in torch, of PyTorch Geometric's layers for the encoder.
        ratio: ``reference / compiled``.
        repeats: calls of each that were timed.
    """

    function: str
    size: int
    batch: int
    compiled: float
    reference: float
    ratio: float
    repeats: int


def measure_compiled(
    makers: Makers,
    explored: Mapping[int, Forests],
    seconds: float,
    progress: Callable[[str], object],
) -> list[Gain]:
    """Times every function of :mod:`forestrl.kernels` and the encoder, and their references.

    Args:
        makers: builds what is measured.
        explored: arenas by their side, from :func:`forestrl.benchmark.run.explore_all`.
        seconds: budget for each version of each function.
        progress: told what was measured.
    """
    gains = []
    for size, forests in explored.items():
        forest, worlds = makers.forest(size, 1), forests.worlds
        observe = partial(
            _call,
            window=makers.window,
            max_frontiers=forests.max_frontiers,
            lidar_range=forest.lidar_range,
        )
        pairs = _functions(worlds, forest.sight_lines, makers.window, observe)
        few = worlds[:GRAPHS]
        graphs = observe(kernels.exploration_graph, few["cells"], few["position"])
        encoder = makers.parts(size, 1, forests.max_frontiers).networks.actor
        pairs[ENCODER] = _encoders(encoder, graphs)
        for name, (compiled, reference) in pairs.items():
            timing = measure({"compiled": compiled, "reference": reference}, seconds)
            batch = GRAPHS if name == ENCODER else len(worlds)
            fast, slow = timing["compiled"].median, timing["reference"].median
            repeats = timing["compiled"].repeats
            gains.append(Gain(name, size, batch, fast / batch, slow / batch, slow / fast, repeats))
        progress(f"compiled functions in {size} x {size}")
    return gains


def _functions(
    worlds: TensorDict, lines: F.SightLines, window: int, observe: Callable[..., Any]
) -> dict[str, tuple[Call, Call]]:
    """Every compiled function and its reference, bound to the same arguments."""
    trees, start = worlds["trees"], worlds["start"]
    cells, position = worlds["cells"], worlds["position"]
    known, traversable = cells == F.Cell.FREE, kernels.component(~trees, start)
    calls: dict[str, Callable[[Callable[..., Any]], object]] = {
        "sense": lambda f: f(trees, traversable, cells, position, lines),
        "exploration_graph": lambda f: observe(f, cells, position),
        "potential": lambda f: f(cells, position, window=window, beta=_BETA),
        "path_lengths": lambda f: f(known, position),
        "component": lambda f: f(~trees, start),
        "largest_component": lambda f: f(~trees),
    }
    return {
        name: (partial(call, getattr(kernels, name)), partial(call, getattr(F, name)))
        for name, call in calls.items()
    }


def _call(function: Callable[..., Any], *args: object, **options: object) -> Any:
    return function(*args, **options)


def _encoders(encoder: GATv2Encoder, graphs: F.Graph) -> tuple[Call, Call]:
    """Both passes of the compiled encoder and of PyTorch Geometric's, with the same weights."""

    def both_passes(network: GATv2Encoder) -> None:
        network(*graphs).sum().backward()

    fused, pyg = copy.deepcopy(encoder), copy.deepcopy(encoder)
    fused.kernel, pyg.kernel = "fused", "pyg"
    return partial(both_passes, fused), partial(both_passes, pyg)


def write_compiled(gains: Sequence[Gain], folder: Path) -> str:
    """Writes ``compiled.csv`` and ``compiled.txt``; returns the table."""
    names = [field.name for field in fields(Gain)]
    atomic_write(folder / "compiled.csv", to_csv(names, map(asdict, gains)))
    lines = [
        "microseconds for a map, or for a graph of a minibatch; compiled and reference in turns",
        f"{'function':<26}{'side':>6}{'compiled':>12}{'reference':>12}{'ratio':>9}",
    ]
    lines += [
        f"{gain.function:<26}{gain.size:>6}{1e6 * gain.compiled:>12.2f}"
        f"{1e6 * gain.reference:>12.2f}{gain.ratio:>9.1f}"
        for gain in gains
    ]
    text = "\n".join(lines)
    atomic_write(folder / "compiled.txt", text + "\n")
    return text
