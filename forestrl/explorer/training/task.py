"""What a search is given, and what it tells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from forestrl.explorer.compiled import Weights
from forestrl.explorer.training.episodes import explore
from forestrl.planners.viewpoints.sight import sight

LIMIT = 1500
"""Steps after which an episode that covers nothing more is given up."""


class Arenas(NamedTuple):
    """Arenas with a start each."""

    trees: np.ndarray
    """Bool ``[n, H, W]``."""
    starts: np.ndarray
    """(row, col), int64 ``[n, 2]``."""


class Source(Protocol):
    """A source of arenas, as the env's world is one."""

    def sample(
        self, batch: tuple[int, ...], *, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draws occupied cells ``[*batch, H, W]`` and starts ``[*batch, 2]``."""


@dataclass(frozen=True)
class Task:
    """What is to be solved.

    Attributes:
        world: where arenas come from.
        lidar_range: ``l``, cells.
        coverage_goal: the coverage that ends an episode.
        seed: of arenas and draws.
        validation: arenas on which policies are compared.
    """

    world: Source
    lidar_range: float
    coverage_goal: float
    seed: int
    validation: Arenas

    def draw(self, number: int, *which: int) -> tuple[Arenas, torch.Generator]:
        """Draws arenas that depend on the seed and ``which`` only, and goes on from there.

        Args:
            number: of arenas.
            which: whole numbers that name them, such as the round.
        """
        words = np.random.SeedSequence([self.seed, *which]).generate_state(1, np.uint64)
        generator = torch.Generator().manual_seed(int(words[0] >> np.uint64(1)))
        trees, starts = self.world.sample((number,), generator=generator)
        return Arenas(trees.numpy(), starts.numpy()), generator

    def steps(self, weights: Weights, arenas: Arenas) -> np.ndarray:
        """Explores arenas; gives the steps to the coverage goal, int64 ``[n]``."""
        steps = np.empty(len(arenas.trees), np.int64)
        lines = sight(self.lidar_range, arenas.trees.shape[2])
        explore(*arenas, lines, weights, self.coverage_goal, LIMIT, steps)
        return steps


class Told(NamedTuple):
    """How far a search has come."""

    done: int
    metrics: dict[str, float]
    network: nn.Module | None
    """The best so far; None if it has not changed."""


class Search(Protocol):
    """A training that plays whole episodes and needs no gradient through them."""

    unit: str
    """What its progress is counted in."""
    total: int
    """How much of that there is to do."""

    def run(self, network: Any, task: Task, folder: Path) -> Iterator[Told]:
        """Searches; what is kept in the folder lets an interrupted search go on.

        Args:
            network: to start with.
            task: what is to be solved.
            folder: of the run.
        """
