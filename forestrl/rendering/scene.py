"""What a picture shows: one step of an episode, and the way that led there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs import EnvBase

from forestrl import functional as F
from forestrl import keys as K
from forestrl.status import Status

Cell = tuple[int, ...]


@dataclass
class Trail:
    """What an episode leaves behind, oldest first."""

    cells: list[Cell] = field(default_factory=list)
    """Where the robot was before each step."""
    coverage: list[float] = field(default_factory=list)
    """``rho`` there."""
    interventions: list[Cell] = field(default_factory=list)
    """Where the safety filter stepped in."""
    collisions: list[Cell] = field(default_factory=list)
    """Where the robot ran into a trunk or the arena's edge."""

    def grow(self, step: TensorDictBase) -> None:
        """Adds a step: a state without batch dimensions, with ``"next"``."""
        cell = _cell(step[K.POSITION])
        self.cells.append(cell)
        self.coverage.append(float(step[K.COVERAGE]))
        if _is_set(step, ("next", *K.INTERVENED)):
            self.interventions.append(cell)
        if _is_set(step, ("next", *K.COLLISION)):
            self.collisions.append(cell)


class Scene:
    """One step of an episode as plain numbers.

    Args:
        step: a state without batch dimensions. A policy's ``"action"`` and ``"logits"``, a
            planner's status, what the filter and the graph write and what came of the action, under
            ``"next"``, are read if they are there.
        trail: what happened before.
        lidar_range: ``l``, cells.
        coverage_goal: ``rho*``.
    """

    def __init__(
        self,
        step: TensorDictBase,
        trail: Trail | None = None,
        *,
        lidar_range: float,
        coverage_goal: float,
    ) -> None:
        cells, position = step[K.CELLS], step[K.POSITION]
        self.lidar_range, self.coverage_goal = lidar_range, coverage_goal
        self.trees, self.cells = step[K.TREES].cpu().numpy(), cells.cpu().numpy()
        self.frontier: list[Cell] = [tuple(cell) for cell in F.frontier(cells).nonzero().tolist()]
        self.agent = _cell(position)
        self.step, self.coverage = int(step[K.STEP_COUNT]), float(step[K.COVERAGE])
        self.has_filter = step.get(K.INTERVENED, None) is not None
        self.intervened = _is_set(step, ("next", *K.INTERVENED))
        self.collided = _is_set(step, ("next", *K.COLLISION))
        before = Trail() if trail is None else trail
        self.way: tuple[Cell, ...] = (*before.cells, self.agent)
        self.curve: tuple[float, ...] = (*before.coverage, self.coverage)
        self.interventions = (*before.interventions, *[self.agent] * self.intervened)
        self.collisions = (*before.collisions, *[self.agent] * self.collided)
        self._read_decision(step)
        self._read_graph(step)

    def _read_decision(self, step: TensorDictBase) -> None:
        cells, position = step[K.CELLS], step[K.POSITION]
        self.feasible: list[bool] = F.feasible(cells, position).tolist()
        self.targets: list[Cell] = [tuple(cell) for cell in F.targets(position).tolist()]
        action, logits = step.get(K.ACTION, None), step.get(K.LOGITS, None)
        self.proposed = None if action is None else int(action)
        executed = step.get(("next", *K.EXECUTED), None)
        self.executed = self.proposed if executed is None else int(executed)
        self.probability: list[float] | None = None
        if logits is not None and logits.shape == (len(self.targets),):
            self.probability = logits.float().softmax(-1).tolist()
        status = step.get(K.STATUS, None)
        self.status = Status.EXPLORING if status is None else Status(int(status))

    def _read_graph(self, step: TensorDictBase) -> None:
        """Reads Eq. 2's edges: each frontier cell that has a node, and its waypoint."""
        waypoint, count = step.get(K.WAYPOINT, None), step.get(K.FRONTIERS, None)
        self.has_graph = waypoint is not None
        self.ties: list[tuple[Cell, Cell]] = []
        if waypoint is None or count is None:
            return
        frontier = F.frontier(step[K.CELLS])
        nodes, _ = F.nearest_first(frontier, step[K.POSITION], len(waypoint))
        pairs = zip(nodes.tolist(), waypoint.tolist(), strict=True)
        ties = [(tuple(node), self.targets[index]) for node, index in pairs]
        self.ties = ties[: int(count)]

    def strength(self, action: int) -> float | None:
        """Gives an action's probability in units of the likeliest one's, if it is known."""
        if self.probability is None:
            return None
        return self.probability[action] / max(self.probability)


@torch.no_grad()
def play(
    env: EnvBase,
    policy: Callable[[TensorDictBase], TensorDictBase],
    td_reset: TensorDictBase | None = None,
    *,
    steps: int,
    every: int = 1,
    uniforms: Tensor | None = None,
) -> Iterator[Scene]:
    """Runs one episode, up to the coverage goal, and shows every few steps of it.

    Args:
        env: the forest with its transforms; of several arenas the first is shown.
        policy: writes ``"action"``.
        td_reset: the arena, as ``env.reset`` takes it with ``set_state=True``; None for a new one.
        steps: steps of the episode at the most.
        every: a scene is given of every so many steps, and one of the end.
        uniforms: what stochastic policies sample with, ``[*B, steps]``.

    Yields:
        the scenes, one at a time.
    """
    forest = getattr(env, "base_env", env)
    task = {"lidar_range": forest.lidar_range, "coverage_goal": forest.coverage_goal}
    if td_reset is None:
        td = env.reset()
    else:
        td = env.reset(td_reset.copy(), set_state=True)  # a copy, as it is filled in
    trail = Trail()
    for step in range(steps):
        if uniforms is not None:
            td.set(K.UNIFORM, uniforms[..., step])
        td = env.step(policy(td))
        first = _first(td)
        if step % every == 0:
            yield Scene(first, trail, **task)
        trail.grow(first)
        td = env.step_mdp(td)
        if first["next", "terminated"].item():
            break
    yield Scene(_first(td).exclude(K.ACTION, K.LOGITS), trail, **task)


def _first(td: TensorDictBase) -> TensorDictBase:
    return td.flatten()[0] if td.batch_dims else td


def _cell(position: Tensor) -> Cell:
    return tuple(position.tolist())


def _is_set(td: TensorDictBase, key: tuple[str, ...]) -> bool:
    flag = td.get(key, None)
    return flag is not None and bool(flag)
