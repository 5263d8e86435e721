"""An episode as plain data: what became known, where the robot was, what was decided and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs import EnvBase

from forestrl.rendering.scene import Cell, Scene, play
from forestrl.status import Status


class Considered(NamedTuple):
    """The viewpoints that a policy compared, the best first, and the way to its goal."""

    cells: tuple[Cell, ...]
    scores: tuple[float, ...]
    way: tuple[Cell, ...]
    """From the robot's neighbour to the goal."""


NOTHING = Considered((), (), ())


class Moment(NamedTuple):
    """A state of an episode, and the decision that was taken there."""

    changed: NDArray[np.int64]
    """The cells of the map that differ from the state before, by their row-major numbers, ``[n]``;
    at first the map is unknown everywhere."""
    values: NDArray[np.uint8]
    """What they are now, ``Cell``, ``[n]``."""
    agent: Cell
    """(row, col)."""
    coverage: float
    """``rho``, a share."""
    feasible: tuple[bool, ...]
    """Of the nine actions."""
    proposed: int | None
    """``u^pi``; None at the end, where nothing is decided any more."""
    executed: int | None
    """``u^sigma``."""
    collided: bool
    """Whether the action led into a trunk or out of the arena."""
    status: Status
    """Whether, and why, a classical planner stays."""
    probability: tuple[float, ...] | None
    """Of the nine actions; None for a policy without."""
    waypoints: NDArray[np.uint8]
    """Of each frontier cell in row-major order, the waypoint it is tied to (Eq. 2), 1 to 8; 0 for
    those without a node. Empty for a policy that reads no graph."""
    considered: Considered
    """Empty for a policy that compares no viewpoints."""


@dataclass(frozen=True)
class Recording:
    """An episode from the first scan to the last."""

    trees: NDArray[np.bool_]
    """The truth, ``[H, W]``."""
    lidar_range: float
    """``l``, cells."""
    coverage_goal: float
    """``rho*``, a share."""
    has_filter: bool
    """Whether Algorithm 1 watched over the actions."""
    has_graph: bool
    """Whether the policy read the exploration graph."""
    moments: tuple[Moment, ...]
    """One more than there were steps."""

    @property
    def steps(self) -> int:
        """How many steps were made."""
        return len(self.moments) - 1

    @property
    def coverage(self) -> list[float]:
        """Coverage after 0, 1, 2, ... steps, shares."""
        return [moment.coverage for moment in self.moments]

    def map_at(self, step: int) -> NDArray[np.uint8]:
        """Gives the robot's map after so many steps, ``Cell`` values ``[H, W]``."""
        cells = np.zeros(self.trees.size, np.uint8)
        for moment in self.moments[: step + 1]:
            cells[moment.changed] = moment.values
        return cells.reshape(self.trees.shape)


def record(
    env: EnvBase,
    policy: Callable[[TensorDictBase], TensorDictBase],
    td_reset: TensorDictBase | None = None,
    *,
    steps: int,
    uniforms: Tensor | None = None,
) -> Recording:
    """Plays one episode, up to the coverage goal, and keeps all that a page shows of it.

    A policy with a method ``viewpoints(step)``, which takes a state without batch dimensions and
    gives cells ``[n, 2]``, scores ``[n]`` and a way ``[m, 2]``, shows what it compared.

    Args:
        env: the forest with its transforms; of several arenas the first is recorded.
        policy: writes ``"action"``.
        td_reset: the arena, as ``env.reset`` takes it with ``set_state=True``; None for a new one.
        steps: steps of the episode at the most.
        uniforms: what stochastic policies sample with, ``[*B, steps]``.
    """
    watched, moments = _Watched(policy), []
    cells: NDArray[np.uint8] | None = None
    for scene in play(env, watched, td_reset, steps=steps, uniforms=uniforms):
        cells = np.zeros_like(scene.cells) if cells is None else cells
        moments.append(_moment(scene, cells, watched.considered))
        cells = scene.cells.copy()
    return Recording(
        trees=scene.trees,
        lidar_range=scene.lidar_range,
        coverage_goal=scene.coverage_goal,
        has_filter=scene.has_filter,
        has_graph=any(len(moment.waypoints) for moment in moments),
        moments=tuple(moments),
    )


class _Watched:
    """A policy whose viewpoints are asked for before every decision."""

    def __init__(self, policy: Callable[[TensorDictBase], TensorDictBase]) -> None:
        self.policy, self.considered = policy, NOTHING

    def __call__(self, td: TensorDictBase) -> TensorDictBase:
        if hasattr(self.policy, "viewpoints"):
            found = self.policy.viewpoints(td.flatten()[0] if td.batch_dims else td)
            cells, way = ([tuple(map(int, cell)) for cell in part] for part in (found[0], found[2]))
            self.considered = Considered(tuple(cells), tuple(map(float, found[1])), tuple(way))
        return self.policy(td)


def _moment(scene: Scene, before: NDArray[np.uint8], considered: Considered) -> Moment:
    changed = np.flatnonzero(scene.cells != before)
    decides = scene.proposed is not None and scene.status == Status.EXPLORING
    action = {target: index for index, target in enumerate(scene.targets)}
    ties = {node: action[waypoint] for node, waypoint in scene.ties}
    reads = scene.has_graph and scene.probability is not None
    shown = [ties.get(cell, 0) for cell in scene.frontier] if reads else []
    return Moment(
        changed=changed,
        values=scene.cells.reshape(-1)[changed],
        agent=scene.agent,
        coverage=scene.coverage,
        feasible=tuple(scene.feasible),
        proposed=scene.proposed,
        executed=scene.executed,
        collided=scene.collided,
        status=scene.status,
        probability=None if scene.probability is None else tuple(scene.probability),
        waypoints=np.array(shown, np.uint8),
        considered=considered if decides else NOTHING,
    )
