"""The forest arena as a TorchRL environment."""

from __future__ import annotations

import secrets
from typing import Annotated

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor
from torchrl.data import Binary, Bounded, Categorical, Composite, Unbounded
from torchrl.envs import EnvBase

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.envs.worlds import RandomForest, World
from forestrl.settings import Range, checked


class ForestEnv(EnvBase):
    """One agent with a LiDAR explores an arena of tree trunks (Sec. II-A).

    The state travels in the TensorDict: ``step`` is a pure function of its input, and any
    situation a test can write down can be stepped from. The reward is ``n^e_t``, the number of
    newly seen cells; shaping it (Eq. 6) is a transform's business. An infeasible action leaves the
    agent where it is and raises ``("safety", "collision")``.

    ``reset(td, set_state=True)`` starts in the state that ``td`` holds. It needs
    ``("arena", "trees")``; what else of the state is there is taken as it is, and the rest follows
    from it: without ``("agent", "position")`` the start is drawn from the largest component,
    without ``("map", "cells")`` the map is that of a first scan.

    Args:
        world: where arenas and starts come from; by default forests of Table III.
        lidar_range: sensor range ``l``, cells.
        coverage_goal: exploration threshold ``rho*``, a share of the traversable cells.
        max_steps: step budget ``n_s*``.
        num_envs: arenas stepped at once; ``None`` for an env without batch dimension.
        seed: seed of the env's own generator; ``None`` for one that no other env has.
        device: where the arenas live.

    Raises:
        ValueError: if a value is out of its range; the message names both.

    Examples:
        >>> env = ForestEnv(RandomForest(20, n_trees=5), num_envs=3)
        >>> env.reset()["map", "cells"].shape
        torch.Size([3, 20, 20])
    """

    _supports_set_state = True  # TorchRL's own word for reset(td, set_state=True)

    @checked
    def __init__(
        self,
        world: World | None = None,
        lidar_range: Annotated[float, Range(1.415, 100)] = 5.0,
        coverage_goal: Annotated[float, Range(above=0, high=1)] = 0.98,
        max_steps: Annotated[int, Range(1, 1_000_000_000)] = 2500,
        num_envs: Annotated[int, Range(1, 65_536)] | None = None,
        seed: Annotated[int, Range(0, 2**63 - 1)] | None = None,
        device: torch.device | str = "cpu",
    ) -> None:
        super().__init__(device=device, batch_size=[] if num_envs is None else [num_envs])
        self.world: World = RandomForest() if world is None else world
        self.coverage_goal, self.max_steps = coverage_goal, max_steps
        self.lidar_range = lidar_range
        lines = F.sight_lines(lidar_range)
        self.sight_lines = F.SightLines(*(part.to(self.device) for part in lines))
        self._make_specs()
        self.set_seed(seed)
        once = torch.Generator(self.device).manual_seed(0)
        _check_arenas(*self.world.sample((), generator=once), self.world.shape)

    def _reset(
        self, tensordict: TensorDictBase | None = None, *, set_state: bool = False
    ) -> TensorDictBase:
        mask = None if tensordict is None else tensordict.get("_reset", None)
        if mask is not None:
            mask = mask.reshape(self.batch_size)
        if set_state and tensordict is not None:
            rows = tensordict if mask is None else tensordict[mask]
            fresh = self._restored(rows.to(self.device))
        else:
            batch = self.batch_size if mask is None else (int(mask.sum()),)
            fresh = self._start(*self.world.sample(tuple(batch), generator=self.rng))
        if mask is None:
            return fresh
        state = fresh.new_zeros(self.batch_size) if fresh.numel() else self._blank()
        state[mask] = fresh
        return state

    def _blank(self) -> TensorDictBase:
        return self.full_observation_spec.zero().update(self.full_done_spec.zero())

    def _start(self, trees: Tensor, position: Tensor) -> TensorDictBase:
        """Senses for the first time from the start of an episode."""
        traversable = kernels.component(~trees, position)
        blank = torch.full_like(trees, int(F.Cell.UNKNOWN), dtype=torch.uint8)
        steps = torch.zeros(*trees.shape[:-2], 1, dtype=torch.int64, device=self.device)
        no = torch.zeros_like(steps, dtype=torch.bool)
        state = self._sense(trees, traversable, blank, position, no, steps).exclude("reward")
        return state.update({key: no.clone() for key in ("done", "terminated", "truncated")})

    def _restored(self, given: TensorDictBase) -> TensorDictBase:
        """The state that is given, completed where it says nothing."""
        trees, position = given.get(K.TREES, None), given.get(K.POSITION, None)
        if trees is None:
            raise ValueError('reset(td, set_state=True) needs ("arena", "trees") in td')
        _check_arenas(trees, position, (*given.batch_size, *self.world.shape))
        if position is None:
            position = F.sample_position(kernels.largest_component(~trees), self.rng)
        state = self._start(trees, position)
        known = [
            key for key in self.state_spec.keys(True, True) if given.get(key, None) is not None
        ]
        state.update(given.select(*known).clone())
        if K.CELLS in known:
            state[K.COVERAGE] = F.coverage(state[K.CELLS], state[K.TRAVERSABLE])
        return state

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        trees, action = tensordict[K.TREES], tensordict[K.ACTION]
        F.check_action(action)
        position, collision = F.move(trees, tensordict[K.POSITION], action)
        return self._sense(
            trees,
            tensordict[K.TRAVERSABLE],
            tensordict[K.CELLS],
            position,
            collision.unsqueeze(-1),
            tensordict[K.STEP_COUNT] + 1,
        )

    def _sense(
        self,
        trees: Tensor,
        traversable: Tensor,
        cells: Tensor,
        position: Tensor,
        collision: Tensor,
        steps: Tensor,
    ) -> TensorDictBase:
        """Scans from ``position`` and describes the state reached."""
        cells, new_cells, coverage = kernels.sense(
            trees, traversable, cells, position, self.sight_lines
        )
        terminated, truncated = coverage >= self.coverage_goal, steps >= self.max_steps
        return TensorDict(
            {
                "arena": {"trees": trees, "traversable": traversable},
                "map": {"cells": cells},
                "agent": {"position": position},
                "exploration": {"new_cells": new_cells, "coverage": coverage},
                "safety": {"collision": collision},
                K.STEP_COUNT: steps,
                "reward": new_cells.clone(),
                "terminated": terminated,
                "truncated": truncated,
                "done": terminated | truncated,
            },
            batch_size=steps.shape[:-1],
            device=self.device,
        )

    def _make_specs(self) -> None:
        b, (height, width) = self.batch_size, self.world.shape
        last = torch.tensor([height - 1, width - 1]).expand(*b, 2)
        entries = {
            K.TREES: Binary(shape=(*b, height, width), dtype=torch.bool),
            K.TRAVERSABLE: Binary(shape=(*b, height, width), dtype=torch.bool),
            K.CELLS: Categorical(len(F.Cell), shape=(*b, height, width), dtype=torch.uint8),
            K.POSITION: Bounded(torch.zeros_like(last), last, shape=(*b, 2), dtype=torch.int64),
            K.NEW_CELLS: Bounded(0.0, float(height * width), shape=(*b, 1)),
            K.COVERAGE: Bounded(0.0, 1.0, shape=(*b, 1)),
            K.COLLISION: Binary(shape=(*b, 1), dtype=torch.bool),
            K.STEP_COUNT: Bounded(0, self.max_steps, shape=(*b, 1), dtype=torch.int64),
        }
        self.observation_spec = Composite(entries, shape=b, device=self.device)
        self.state_spec = self.observation_spec.clone()
        self.action_spec = Categorical(len(F.DISPLACEMENTS), shape=b, device=self.device)
        self.reward_spec = Unbounded(shape=(*b, 1), device=self.device)
        flag = Binary(shape=(*b, 1), dtype=torch.bool)
        self.full_done_spec = Composite(
            done=flag,
            terminated=flag.clone(),
            truncated=flag.clone(),
            shape=b,
            device=self.device,
        )

    def _set_seed(self, seed: int | None) -> None:
        seed = secrets.randbits(63) if seed is None else seed
        self.rng = torch.Generator(device=self.device).manual_seed(seed)


def _check_arenas(trees: Tensor, position: Tensor | None, shape: tuple[int, ...]) -> None:
    """Refuses arenas and starts that do not fit the env."""
    if tuple(trees.shape) != tuple(shape) or trees.dtype != torch.bool:
        raise ValueError(
            f'("arena", "trees") has shape {tuple(trees.shape)} and dtype {trees.dtype}: '
            f"this env takes {tuple(shape)} and torch.bool"
        )
    if trees.flatten(-2).all(-1).any():
        raise ValueError('("arena", "trees") leaves no free cell in some arena')
    if position is not None and F.gather(trees, position.unsqueeze(-2), outside=True).any():
        raise ValueError('("agent", "position") must be a free cell inside the arena')
