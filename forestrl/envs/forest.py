"""The forest arena as a TorchRL environment."""

from __future__ import annotations

import math
from functools import partial

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor
from torchrl.data import Binary, Bounded, Categorical, Composite, Unbounded
from torchrl.envs import EnvBase

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K

SMALLEST_SIZE = 3
_ATTEMPTS = 8  # forests drawn before giving up on finding one with a free cell


class ForestEnv(EnvBase):
    """One agent with a LiDAR explores a square arena of tree trunks (Sec. II-A).

    The state travels in the TensorDict: ``step`` is a pure function of its input, and any
    situation a test can write down can be stepped from. The reward is ``n^e_t``, the number of
    newly seen cells; shaping it (Eq. 6) is a transform's business. An infeasible action leaves the
    agent where it is and raises ``("safety", "collision")``.

    ``reset(td)`` with ``("arena", "trees")`` in ``td`` starts in that world, at
    ``("agent", "position")`` if that is given too; a partial reset (``"_reset"`` in ``td``) always
    draws new arenas.

    Args:
        size: arena side ``h``, cells.
        n_trees: number of trunks ``n_t``.
        tree_radius: range of trunk radii ``r_t``, cells.
        lidar_range: sensor range ``l``, cells.
        coverage_goal: exploration threshold ``rho*``, a share of the traversable cells.
        max_steps: step budget ``n_s*``.
        num_envs: arenas stepped at once; ``None`` for an env without batch dimension.
        seed: seed of the env's own generator.
        device: where the arenas live.

    Raises:
        ValueError: if a value is out of its range; the message names both.

    Examples:
        >>> env = ForestEnv(size=20, n_trees=5, num_envs=3)
        >>> env.reset()["map", "cells"].shape
        torch.Size([3, 20, 20])
    """

    def __init__(
        self,
        size: int = 50,
        n_trees: int = 45,
        tree_radius: tuple[float, float] = (1.0, 3.0),
        lidar_range: float = 5.0,
        coverage_goal: float = 0.98,
        max_steps: int = 2500,
        num_envs: int | None = None,
        seed: int = 0,
        device: torch.device | str = "cpu",
    ) -> None:
        _check("size", size, size >= SMALLEST_SIZE, f"at least {SMALLEST_SIZE}")
        _check("n_trees", n_trees, n_trees >= 0, "0 or more")
        ordered = len(tree_radius) == 2 and 0 < tree_radius[0] <= tree_radius[1]
        _check(
            "tree_radius",
            list(tree_radius),
            ordered,
            "[smallest, largest] with 0 < smallest <= largest",
        )
        in_sight = lidar_range >= math.sqrt(2)
        _check("lidar_range", lidar_range, in_sight, "at least 1.415: the 8 neighbours are seen")
        _check("coverage_goal", coverage_goal, 0 < coverage_goal <= 1, "in (0, 1]")
        _check("max_steps", max_steps, max_steps >= 1, "at least 1")
        _check("num_envs", num_envs, num_envs is None or num_envs >= 1, "at least 1")
        super().__init__(device=device, batch_size=[] if num_envs is None else [num_envs])
        self.size, self.n_trees = size, n_trees
        self.tree_radius = (tree_radius[0], tree_radius[1])
        self.coverage_goal, self.max_steps = coverage_goal, max_steps
        self.lidar_range = lidar_range
        lines = F.sight_lines(lidar_range)
        self.sight_lines = F.SightLines(*(part.to(self.device) for part in lines))
        self._make_specs()
        self.set_seed(seed)
        sample_arena(self, generator=torch.Generator(self.device).manual_seed(0))  # is one possible

    def _reset(self, tensordict: TensorDictBase | None = None, **kwargs: object) -> TensorDictBase:
        given = tensordict if tensordict is not None else TensorDict()
        mask = given.get("_reset", None)
        if mask is None:
            return self._start(*self._arenas(self.batch_size, given))
        mask = mask.reshape(self.batch_size)
        fresh = self._start(*self._arenas((int(mask.sum()),), TensorDict()))
        state = fresh.new_zeros(self.batch_size) if fresh.numel() else self._blank()
        state[mask] = fresh
        return state

    def _blank(self) -> TensorDictBase:
        return self.full_observation_spec.zero().update(self.full_done_spec.zero())

    def _arenas(self, batch: tuple[int, ...], given: TensorDictBase) -> tuple[Tensor, Tensor]:
        """Takes or draws trunks and start: bool ``[*batch, h, h]`` and int64 ``[*batch, 2]``."""
        trees, position = given.get(K.TREES, None), given.get(K.POSITION, None)
        if trees is None:
            return sample_arena(self, batch, generator=self.rng)
        _check_world(trees, position, (*batch, self.size, self.size))
        if position is None:
            position = F.sample_position(kernels.largest_component(~trees), self.rng)
        return trees, position

    def _start(self, trees: Tensor, position: Tensor) -> TensorDictBase:
        """Senses for the first time from the start of an episode."""
        traversable = kernels.component(~trees, position)
        blank = torch.full_like(trees, int(F.Cell.UNKNOWN), dtype=torch.uint8)
        steps = torch.zeros(*trees.shape[:-2], 1, dtype=torch.int64, device=self.device)
        no = torch.zeros_like(steps, dtype=torch.bool)
        state = self._sense(trees, traversable, blank, position, no, steps).exclude("reward")
        return state.update({key: no.clone() for key in ("done", "terminated", "truncated")})

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        trees = tensordict[K.TREES]
        position, collision = F.move(trees, tensordict[K.POSITION], tensordict[K.ACTION])
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
        b, h = self.batch_size, self.size
        entries = {
            K.TREES: Binary(shape=(*b, h, h), dtype=torch.bool),
            K.TRAVERSABLE: Binary(shape=(*b, h, h), dtype=torch.bool),
            K.CELLS: Categorical(len(F.Cell), shape=(*b, h, h), dtype=torch.uint8),
            K.POSITION: Bounded(0, h - 1, shape=(*b, 2), dtype=torch.int64),
            K.NEW_CELLS: Bounded(0.0, float(h * h), shape=(*b, 1)),
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
        self.rng = torch.Generator(device=self.device).manual_seed(seed or 0)


def sample_arena(
    env: ForestEnv, batch: tuple[int, ...] = (), *, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Draws forests and starts for an env: the start is a free cell of the largest component.

    A forest without a free cell is drawn again.

    Args:
        env: gives size, number of trunks and their radii.
        batch: leading dimensions.
        generator: source of randomness.

    Returns:
        occupied cells, bool ``[*batch, h, h]``, and starts, int64 ``[*batch, 2]``.

    Raises:
        ValueError: if no forest with a free cell turns up.
    """
    draw = partial(F.sample_trees, size=env.size, n_trees=env.n_trees, tree_radius=env.tree_radius)
    trees = draw(batch, generator=generator)
    for _ in range(_ATTEMPTS):
        full = trees.flatten(-2).all(-1)
        if not full.any():
            start = F.sample_position(kernels.largest_component(~trees), generator)
            return trees, start
        trees = torch.where(full[..., None, None], draw(batch, generator=generator), trees)
    raise ValueError(
        f"n_trees={env.n_trees} of radius {list(env.tree_radius)} leaves no free cell in an arena "
        f"of size={env.size}: take fewer or thinner trees or a larger arena"
    )


def _check(name: str, value: object, allowed: bool, meaning: str) -> None:
    if not allowed:
        raise ValueError(f"{name}={value} is not allowed: it must be {meaning}")


def _check_world(trees: Tensor, position: Tensor | None, shape: tuple[int, ...]) -> None:
    """Refuses a world given to ``reset`` that does not fit the env."""
    if tuple(trees.shape) != shape or trees.dtype != torch.bool:
        raise ValueError(
            f'("arena", "trees") has shape {tuple(trees.shape)} and dtype {trees.dtype}: '
            f"this env takes {shape} and torch.bool"
        )
    if trees.flatten(-2).all(-1).any():
        raise ValueError('("arena", "trees") leaves no free cell in some arena')
    if position is not None and F.gather(trees, position.unsqueeze(-2), outside=True).any():
        raise ValueError('("agent", "position") must be a free cell inside the arena')
