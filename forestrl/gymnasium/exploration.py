"""One robot that explores one forest after the other, as a Gymnasium environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray
from tensordict import TensorDict, TensorDictBase
from torchrl.envs import Compose, Transform, TransformedEnv

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import (
    ExplorationGraph,
    ForestEnv,
    FrontierPotentialReward,
    SafetyFilter,
    World,
)
from forestrl.rendering import Scene, draw_frame
from forestrl.rendering.scene import Trail
from forestrl.settings import checked

Observation = dict[str, NDArray[Any]]


class Exploration(gymnasium.Env[Observation, np.int64]):
    """The forest, the safety filter, the graph observation and the frontier-potential reward.

    The observation is the exploration graph (Eqs. 1 and 2), padded to ``M`` frontier nodes:

    * ``"nodes"`` float32 ``[(9 + M) * 8]``: the features of agent, eight waypoints and frontier
      cells, one node after the other; ``reshape(-1, 8)`` gives one row a node;
    * ``"waypoint"`` int64 ``[M]``: the waypoint that each frontier cell is tied to, 1 to 8; 0 where
      there is no frontier cell, and the node's features are 0;
    * ``"length"`` float32 ``[M]``: the length of that edge in units of ``l``.

    The action is one of Table I's nine. ``info`` holds ``"action_mask"`` int8 ``[9]``, the feasible
    actions, as ``action_space.sample`` takes it; ``"position"`` int64 ``[2]`` (row, col);
    ``"coverage"``, ``rho``; ``"collision"`` and ``"intervened"``, what became of the last action.

    An episode is terminated at ``coverage_goal`` and truncated after ``max_steps``.

    Args:
        world: where arenas and starts come from; by default forests of Table III.
        safety: whether the filter replaces infeasible actions (Algorithm 1).
        graph: settings of :class:`~forestrl.envs.ExplorationGraph`, such as ``max_frontiers``.
        reward: settings of :class:`~forestrl.envs.FrontierPotentialReward`, such as ``beta``.
        render_mode: ``"rgb_array"`` for pictures of the episode.
        **forest: settings of :class:`~forestrl.envs.ForestEnv`: ``lidar_range``,
            ``coverage_goal``, ``max_steps``.

    Raises:
        ValueError: if a value is out of its range; the message names both.

    Examples:
        >>> env = Exploration(graph={"max_frontiers": 64})
        >>> observation, info = env.reset(seed=0)
        >>> observation["nodes"].shape, observation["waypoint"].shape
        ((584,), (64,))
        >>> action = env.action_space.sample(info["action_mask"])
        >>> observation, reward, terminated, truncated, info = env.step(action)
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 - Gymnasium's type

    @checked
    def __init__(
        self,
        world: World | None = None,
        *,
        safety: bool = True,
        graph: Mapping[str, Any] | None = None,
        reward: Mapping[str, Any] | None = None,
        render_mode: Literal["rgb_array"] | None = None,
        **forest: Any,
    ) -> None:
        self.render_mode = render_mode
        self._forest = ForestEnv(world, num_envs=None, seed=None, device="cpu", **forest)
        observe = ExplorationGraph(**(graph or {}))
        transforms: list[Transform] = [observe, FrontierPotentialReward(**(reward or {}))]
        if safety:
            transforms.insert(0, SafetyFilter())
        self._env = TransformedEnv(self._forest, Compose(*transforms))
        self._state: TensorDictBase | None = None
        self._trail = Trail()
        self.action_space = spaces.Discrete(len(F.DISPLACEMENTS))
        self.observation_space = _observation_space(self._forest, observe)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode in a new forest.

        Args:
            seed: begins a sequence of episodes that repeats with the seed; None goes on with it.
            options: ``"trees"``, occupied cells ``[H, W]``, for an arena of one's own, and
                ``"position"``, a free cell (row, col) in it; by default the start is drawn.

        Returns:
            the observation and the info.

        Raises:
            ValueError: if an option is none of these, or does not fit the arena.
        """
        super().reset(seed=seed)
        self._forest.set_seed(int(self.np_random.integers(2**63)))
        given = _given(options or {})
        self._state = self._env.reset(given, set_state=given is not None)
        self._trail = Trail()
        return self._observation(), self._info()

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Takes one of Table I's actions.

        Returns:
            the observation, ``r_t`` (Eq. 6), whether the goal is reached, whether time is up, and
            the info.

        Raises:
            ValueError: if there is no such action.
            gymnasium.error.ResetNeeded: before the first reset.
        """
        td = self._env.step(self._current().set(K.ACTION, torch.as_tensor(int(action))))
        if self.render_mode is not None:
            self._trail.grow(td)
        self._state = after = td["next"]
        ends = bool(after["terminated"]), bool(after["truncated"])
        return self._observation(), float(after["reward"]), *ends, self._info()

    def action_masks(self) -> NDArray[np.bool_]:
        """Tells which actions are feasible on the robot's map, bool ``[9]``, to MaskablePPO."""
        state = self._current()
        return F.feasible(state[K.CELLS], state[K.POSITION]).numpy()

    def render(self) -> NDArray[np.uint8] | None:
        """Draws arena, map and waypoints as they are now, uint8 ``[height, width, 3]``."""
        if self.render_mode is None:
            return None
        task = {
            "lidar_range": self._forest.lidar_range,
            "coverage_goal": self._forest.coverage_goal,
        }
        return np.asarray(draw_frame(Scene(self._current(), self._trail, **task)))

    def _current(self) -> TensorDictBase:
        if self._state is None:
            raise gymnasium.error.ResetNeeded("reset() comes first")
        return self._state

    def _observation(self) -> Observation:
        state = self._current()
        return {
            "nodes": state[K.NODES].flatten().numpy().copy(),
            "waypoint": state[K.WAYPOINT].numpy().copy(),
            "length": state[K.LENGTH].numpy().copy(),
        }

    def _info(self) -> dict[str, Any]:
        state = self._current()
        intervened = state.get(K.INTERVENED, None)
        return {
            "action_mask": self.action_masks().astype(np.int8),
            "position": state[K.POSITION].numpy().copy(),
            "coverage": float(state[K.COVERAGE]),
            "collision": bool(state[K.COLLISION]),
            "intervened": intervened is not None and bool(intervened),
        }


def _observation_space(forest: ForestEnv, graph: ExplorationGraph) -> spaces.Space[Any]:
    """Vectors all, as Stable-Baselines3 takes only images and vectors."""
    room = graph.max_frontiers
    unit = graph.lidar_range or forest.lidar_range
    longest = float(np.hypot(*forest.world.shape)) / unit
    nodes = ((F.WAYPOINTS + room) * F.FEATURES,)
    return spaces.Dict(
        {
            "nodes": spaces.Box(0.0, 1.0, nodes, np.float32),
            "waypoint": spaces.Box(0, F.WAYPOINTS - 1, (room,), np.int64),
            "length": spaces.Box(0.0, longest, (room,), np.float32),
        }
    )


def _given(options: Mapping[str, ArrayLike]) -> TensorDictBase | None:
    """What ``ForestEnv.reset`` takes for the options of a reset."""
    kinds = {"trees": (K.TREES, torch.bool), "position": (K.POSITION, torch.int64)}
    if unknown := options.keys() - kinds.keys():
        raise ValueError(f"options={sorted(unknown)} are not allowed: choose of {list(kinds)}")
    if not options:
        return None
    return TensorDict(
        {
            kinds[name][0]: torch.as_tensor(np.asarray(value), dtype=kinds[name][1])
            for name, value in options.items()
        }
    )
