"""The exploration graph as an observation (Eqs. 1 and 2)."""

from __future__ import annotations

from typing import Annotated

import torch
from tensordict import TensorDictBase
from torchrl.data import Bounded, Categorical, Composite
from torchrl.envs.transforms import Transform

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.envs.asking import setting_of
from forestrl.settings import Range, checked

Window = Annotated[int, Range(1, 101, odd=True)]
WINDOW = 7
"""``k``, cells (Sec. II-B)."""


class ExplorationGraph(Transform):
    """Observes the agent's map as an exploration graph (Eqs. 1 and 2).

    Writes ``("graph", "x")`` float32 ``[*B, 9 + M, 8]``, ``("graph", "waypoint")`` int64
    ``[*B, M]``, ``("graph", "length")`` float32 ``[*B, M]`` and ``("graph", "frontiers")`` int64
    ``[*B, 1]``; see :class:`forestrl.functional.Graph`.

    Args:
        window: ``k``, side of the local window, cells; odd.
        max_frontiers: ``M``, room for frontier nodes; the nearest are kept.
        lidar_range: ``l``, cells, the unit of edge lengths; ``None`` for the env's own.

    Raises:
        ValueError: if ``window`` is even or not positive, or ``max_frontiers`` is less than 1.
    """

    adjustable = ("max_frontiers", "lidar_range")
    """Settings that a trained policy does not depend on."""

    @checked
    def __init__(
        self,
        window: Window = WINDOW,
        max_frontiers: Annotated[int, Range(1, 100_000)] = 256,
        lidar_range: Annotated[float, Range(1.415, 100)] | None = None,
    ) -> None:
        super().__init__(in_keys=[K.CELLS, K.POSITION], out_keys=list(K.GRAPH))
        self.window, self.max_frontiers, self.lidar_range = window, max_frontiers, lidar_range

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        graph = kernels.exploration_graph(
            next_tensordict[K.CELLS],
            next_tensordict[K.POSITION],
            window=self.window,
            max_frontiers=self.max_frontiers,
            lidar_range=setting_of(self, "lidar_range"),
        )
        for key, value in zip(K.GRAPH, graph, strict=True):
            next_tensordict[key] = value
        return next_tensordict

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Observes a map outside any env, as a robot does; ``lidar_range`` must be given then."""
        return self._call(tensordict)

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        return self._call(tensordict_reset)

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Declares the four keys."""
        b, m, device = observation_spec.shape, self.max_frontiers, observation_spec.device
        area = observation_spec[K.CELLS].shape[-2:].numel()
        nodes = (*b, F.WAYPOINTS + m, F.FEATURES)
        observation_spec[K.NODES] = Bounded(0.0, 1.0, shape=nodes, device=device)
        observation_spec[K.WAYPOINT] = Categorical(F.WAYPOINTS, shape=(*b, m), device=device)
        observation_spec[K.LENGTH] = Bounded(0.0, torch.inf, shape=(*b, m), device=device)
        observation_spec[K.FRONTIERS] = Bounded(
            0, area, shape=(*b, 1), dtype=torch.int64, device=device
        )
        return observation_spec

    def metrics(self, batch: TensorDictBase) -> dict[str, float]:
        """Measures a batch of experience: frontier cells, and graphs without room for all."""
        frontiers = batch[K.FRONTIERS]
        return {
            "graph/frontiers": float(frontiers.float().mean()),
            "graph/truncated": float((frontiers > self.max_frontiers).float().mean()),
        }
