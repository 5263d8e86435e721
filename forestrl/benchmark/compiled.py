"""Each compiled function beside the reference that it stands for, on the CPU."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from tensordict import TensorDict

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.benchmark.attention import plain_attend, random_inputs
from forestrl.benchmark.measuring import Stage
from forestrl.envs.graph import WINDOW
from forestrl.policies.gatv2 import GATv2Encoder
from forestrl.policies.gatv2.passes import _attend

_GRAPHS = 16  # of a minibatch (Table III)
_EDGES = 144  # into the core nodes of a mean graph in 50 x 50 cells
_LIDAR_RANGE, _BETA = 5.0, 0.5  # Table III


def compiled(worlds: TensorDict, room: int) -> Iterator[list[Stage]]:
    """Prepares the functions of :mod:`forestrl.kernels` and the network, with the paper's settings.

    Yields:
        the versions of one function; a call works on all explored worlds, whose graphs have
        ``room`` for all frontiers, or on as many graphs as a minibatch.
    """
    trees, cells, position = (worlds[key].cpu() for key in (K.TREES, K.CELLS, K.POSITION))
    reached, lines = kernels.component(~trees, position), F.sight_lines(_LIDAR_RANGE)
    free = cells == F.Cell.FREE
    settings = {"window": WINDOW, "max_frontiers": room, "lidar_range": _LIDAR_RANGE}
    calls: dict[str, Callable[[Any], object]] = {
        "sense": lambda f: f.sense(trees, reached, cells, position, lines),
        "exploration_graph": lambda f: f.exploration_graph(cells, position, **settings),
        "potential": lambda f: f.potential(cells, position, window=WINDOW, beta=_BETA),
        "path_lengths": lambda f: f.path_lengths(free, position),
        "component": lambda f: f.component(~trees, position),
        "largest_component": lambda f: f.largest_component(~trees),
    }
    for name, call in calls.items():
        rooms = {"compiled": kernels, "reference": F}
        yield [Stage(name, len(worlds), partial(call, room), v) for v, room in rooms.items()]
    graphs = kernels.exploration_graph(cells[:_GRAPHS], position[:_GRAPHS], **settings)
    networks = {"compiled": GATv2Encoder(kernel="fused"), "reference": GATv2Encoder(kernel="pyg")}

    def learn(network: GATv2Encoder) -> None:
        network(*graphs).sum().backward()

    name = "GATv2 forward + backward"
    yield [Stage(name, len(graphs.x), partial(learn, each), v) for v, each in networks.items()]
    inputs = random_inputs(_GRAPHS * _EDGES)
    loops = {"compiled": _attend, "plain loops": plain_attend}
    yield [Stage("GATv2 attention", _GRAPHS, partial(f, *inputs), v) for v, f in loops.items()]
