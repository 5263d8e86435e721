"""Whole-budget episodes on test arenas, kept as a few numbers a step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict, TensorDictBase
from torch import Tensor
from torchrl.envs import EnvBase

from forestrl import functional as F
from forestrl import keys as K
from forestrl.evaluation.arenas import draw_arenas, uniforms
from forestrl.evaluation.endings import ending
from forestrl.statistics import normal_interval


class Curve(NamedTuple):
    """Mean coverage by step and its 95 % interval over arenas, each float64 ``[steps + 1]``."""

    mean: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


@dataclass(frozen=True)
class Episodes:
    """What happened in ``n`` arenas over ``steps`` steps each."""

    index: NDArray[np.int64]
    """Number of the arena, ``[n]``."""
    coverage: NDArray[np.float32]
    """``rho`` after each step, ``[n, steps + 1]``; column 0 is the scan before the first step."""
    intervened: NDArray[np.bool_]
    """Whether the safety filter replaced the action, ``[n, steps]``; False without a filter."""
    collisions: NDArray[np.int32]
    """Steps in which an infeasible action reached the world, ``[n]``."""
    path_length: NDArray[np.float32]
    """Length of the way that was gone, cells, ``[n]``: 1 or sqrt(2) a move."""
    free_share: NDArray[np.float32]
    """Share of *all* free cells, sealed pockets included, that is known at the end, ``[n]``."""
    null_actions: NDArray[np.int32]
    """Steps in which the executed action was to stay, ``[n]``."""
    truncated_graphs: NDArray[np.int32]
    """Observations with more frontier cells than the graph has room for, ``[n]``."""
    guarded: NDArray[np.int32]
    """Steps that the explorer's guard against cycles chose, ``[n]``."""
    ending: NDArray[np.int8]
    """Why the episode ended, an ``Ending``, ``[n]``."""

    def __len__(self) -> int:
        return len(self.index)

    @property
    def steps(self) -> int:
        """Steps of each episode."""
        return self.intervened.shape[1]

    def steps_to(self, level: float) -> NDArray[np.float64]:
        """Gives the steps until coverage first reached a level: ``[n]``, nan where it never did."""
        reached = self.coverage >= np.float32(level)
        return np.where(reached.any(1), reached.argmax(1), np.nan)

    def intervention_rate(self) -> NDArray[np.float64]:
        """Gives the share of steps with an intervention, ``[n]``."""
        return self.intervened.mean(1)

    def area_under_curve(self, upto: int) -> NDArray[np.float64]:
        """Gives the mean coverage over the first steps by the trapezoidal rule, ``[n]``.

        Args:
            upto: last step that counts.

        Raises:
            ValueError: if the episodes are shorter than that.
        """
        if not 1 <= upto <= self.steps:
            raise ValueError(f"upto={upto} is not allowed: it must be 1 to {self.steps}")
        coverage = self.coverage[:, : upto + 1].astype(np.float64)
        return (coverage.sum(1) - (coverage[:, 0] + coverage[:, -1]) / 2) / upto

    def mean_curve(self) -> Curve:
        """Gives the mean coverage by step with a normal 95 % interval over arenas."""
        return Curve(*normal_interval(self.coverage))

    @classmethod
    def concatenate(cls, parts: Sequence[Episodes]) -> Episodes:
        """Joins episodes of equal length, in order.

        Raises:
            ValueError: if there are none or their lengths differ.
        """
        if len({part.steps for part in parts}) != 1:
            raise ValueError(f"episodes of one length are needed, got {[p.steps for p in parts]}")
        columns = ([getattr(part, field.name) for part in parts] for field in fields(cls))
        return cls(*(np.concatenate(column) for column in columns))


class Kept(Protocol):
    """Where finished chunks of an evaluation are kept."""

    def load(self, indices: Sequence[int]) -> Episodes | None:
        """Gives the episodes of a chunk, or None if they are not there."""

    def save(self, episodes: Episodes) -> None:
        """Keeps the episodes of a chunk."""


def evaluate(
    env_factory: Callable[[int], EnvBase],
    policy: Callable[[TensorDictBase], TensorDictBase],
    *,
    seed: int,
    indices: Sequence[int],
    steps: int,
    batch: int,
    progress: Callable[[int], object] | None = None,
    parts: Kept | None = None,
) -> Episodes:
    """Runs a policy on test arenas for the whole budget, past the coverage goal.

    What happens in an arena depends on the seed and its number, not on the arenas beside it. Before
    every call of the policy ``"uniform"`` holds a fresh draw for each arena.

    Args:
        env_factory: makes a forest with its transforms for a number of arenas.
        policy: writes ``"action"``.
        seed: seed of the whole evaluation.
        indices: numbers of the arenas.
        steps: steps of each episode.
        batch: arenas stepped at once.
        progress: told, after every step, how many steps are done, counted over all arenas.
        parts: where finished chunks are kept and found again; None for nowhere.

    Returns:
        the episodes, in the order of ``indices``.

    Raises:
        ValueError: if there is nothing to run.
    """
    for name, value in (("len(indices)", len(indices)), ("steps", steps), ("batch", batch)):
        if value < 1:
            raise ValueError(f"{name}={value} is not allowed: at least 1 is needed")
    chunks = [indices[first : first + batch] for first in range(0, len(indices), batch)]
    env, finished, done = env_factory(len(chunks[0])), [], 0
    for chunk in chunks:
        if parts is not None and (kept := parts.load(chunk)) is not None:
            finished.append(kept)
            done += len(chunk) * steps
            continue
        if env.batch_size != (len(chunk),):
            env = env_factory(len(chunk))

        def tell(step: int, done: int = done, size: int = len(chunk)) -> None:
            if progress is not None:
                progress(done + step * size)

        finished.append(_run(env, policy, seed=seed, indices=chunk, steps=steps, tell=tell))
        if parts is not None:
            parts.save(finished[-1])
        done += len(chunk) * steps
    return Episodes.concatenate(finished)


@torch.no_grad()
def _run(
    env: EnvBase,
    policy: Callable[[TensorDictBase], TensorDictBase],
    *,
    seed: int,
    indices: Sequence[int],
    steps: int,
    tell: Callable[[int], None],
) -> Episodes:
    """Runs all arenas of one env at once."""
    draws = uniforms(seed, indices, steps).to(env.device).T.contiguous()  # (steps, n)
    td = env.reset(draw_arenas(env, seed, indices), set_state=True)
    record = _Record(td, steps)
    for step in range(steps):
        td = policy(td.set(K.UNIFORM, draws[step]))
        td = env.step(td)
        record.add(step, td)
        td = env.step_mdp(td)
        tell(step + 1)
    goal = getattr(env, "base_env", env).coverage_goal
    return record.episodes(np.asarray(indices, dtype=np.int64), td, goal)


class _Record:
    """Collects what the episodes keep: a few numbers a step, never a map."""

    def __init__(self, td: TensorDictBase, steps: int) -> None:
        n, device = td.batch_size[0], td.device
        names = ("collisions", "straight", "diagonal", "null_actions", "truncated", "guarded")
        self.coverage = torch.zeros(steps + 1, n, device=device)
        self.coverage[0] = td[K.COVERAGE].squeeze(-1)
        self.intervened = torch.zeros(steps, n, dtype=torch.bool, device=device)
        self.counts = TensorDict(
            {name: torch.zeros(n, dtype=torch.int32, device=device) for name in names}
        )

    def add(self, step: int, td: TensorDictBase) -> None:
        """Takes note of one step: the state, the action and, under ``"next"``, what it led to."""
        after, counts = td["next"], self.counts
        self.coverage[step + 1] = after[K.COVERAGE].squeeze(-1)
        if (intervened := after.get(K.INTERVENED, None)) is not None:
            self.intervened[step] = intervened.squeeze(-1)
        executed = after.get(K.EXECUTED, None)
        moved = (after[K.POSITION] - td[K.POSITION]).abs().sum(-1)  # 0, 1, or 2 on a diagonal
        counts["collisions"] += after[K.COLLISION].squeeze(-1)
        counts["straight"] += moved == 1
        counts["diagonal"] += moved == 2
        counts["null_actions"] += (td[K.ACTION] if executed is None else executed) == F.NULL_ACTION
        if (guarded := td.get(K.GUARDED, None)) is not None:
            counts["guarded"] += guarded
        if (frontiers := td.get(K.FRONTIERS, None)) is not None:
            counts["truncated"] += frontiers.squeeze(-1) > td[K.WAYPOINT].shape[-1]

    def episodes(self, index: NDArray[np.int64], last: TensorDictBase, goal: float) -> Episodes:
        """Gives the record as arrays; ``last`` is the state after the last step."""
        exploring = torch.zeros_like(self.counts["collisions"], dtype=torch.int8)
        status = last.get(K.STATUS, exploring)
        free = ~last[K.TREES]
        known = (free & (last[K.CELLS] == F.Cell.FREE)).sum((-2, -1))
        length = self.counts["straight"] + 2**0.5 * self.counts["diagonal"]
        return Episodes(
            index=index,
            coverage=_array(self.coverage.T),
            intervened=_array(self.intervened.T),
            collisions=_array(self.counts["collisions"]),
            path_length=_array(length),
            free_share=_array(known / free.sum((-2, -1))),
            null_actions=_array(self.counts["null_actions"]),
            truncated_graphs=_array(self.counts["truncated"]),
            guarded=_array(self.counts["guarded"]),
            ending=_array(ending(status, (self.coverage >= goal).any(0))),
        )


def _array(tensor: Tensor) -> NDArray:
    return tensor.contiguous().cpu().numpy()
