"""The whole benchmark: every size and number of arenas, small ones first."""

from __future__ import annotations

import gc
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from tensordict import TensorDict

from forestrl import functional as F
from forestrl import kernels
from forestrl.benchmark.cell import measure_cell, measure_decision
from forestrl.benchmark.rows import Row
from forestrl.benchmark.stages import Parts
from forestrl.benchmark.states import POOL, arrange, explore
from forestrl.envs import ForestEnv

_ROOM = 64  # room for frontiers is made in steps of this


@dataclass(frozen=True)
class Makers:
    """Builds what is measured.

    Attributes:
        forest: makes the bare forest, from arena side and number of arenas.
        parts: makes the rest, from arena side, number of arenas and room for frontiers.
        steps: length of a training episode.
        max_frontiers: least room for frontiers.
        window: side of the window that the graph and the reward count in, cells.
    """

    forest: Callable[[int, int], ForestEnv]
    parts: Callable[[int, int, int], Parts]
    steps: int
    max_frontiers: int
    window: int


@dataclass(frozen=True)
class Forests:
    """Explored arenas of one size.

    Attributes:
        worlds: from :func:`forestrl.benchmark.states.explore`.
        blank: a row with what is known of them.
        max_frontiers: room for all frontiers met in them.
    """

    worlds: TensorDict
    blank: Row
    max_frontiers: int


def explore_all(makers: Makers, sizes: Sequence[int]) -> dict[int, Forests]:
    """Explores arenas of each size."""
    explored = {}
    for size in sizes:
        forest = makers.forest(size, POOL)
        worlds = explore(forest, makers.steps)
        frontiers = F.frontier(worlds["cells"]).sum((-2, -1))
        traversable = kernels.component(~worlds["trees"], worlds["start"])
        blank = Row(
            size=size,
            n_trees=forest.n_trees,
            num_envs=1,
            coverage=float(F.coverage(worlds["cells"], traversable).mean()),
            frontiers=float(frontiers.float().mean()),
        )
        room = -(-int(frontiers.max()) // _ROOM) * _ROOM
        explored[size] = Forests(worlds, blank, max(room, makers.max_frontiers))
    return explored


def run(
    makers: Makers,
    explored: Mapping[int, Forests],
    num_envs: Sequence[int],
    seconds: float,
    progress: Callable[[str], object],
) -> list[Row]:
    """Measures every stage at every size and number of arenas.

    Args:
        makers: builds what is measured.
        explored: arenas by their side, from :func:`explore_all`.
        num_envs: numbers of arenas stepped at once.
        seconds: budget for each stage of each cell.
        progress: told what was measured.

    Returns:
        all rows, by size and number of arenas.
    """
    rows = []
    for size, arenas in by_work(list(explored), num_envs):
        known = explored[size]
        parts = makers.parts(size, arenas, known.max_frontiers)
        blank = replace(known.blank, num_envs=arenas)
        rows += measure_cell(parts, arrange(known.worlds, arenas), blank, seconds)
        del parts
        gc.collect()
        progress(f"{arenas} of {size} x {size}")
    for size, known in explored.items():
        parts = makers.parts(size, 1, known.max_frontiers)
        rows += measure_decision(parts, arrange(known.worlds, 1), known.blank, seconds)
        progress(f"decisions in {size} x {size}")
    return sorted(rows, key=lambda row: (row.size, row.num_envs))  # stable: stages stay in order


def by_work(sizes: Sequence[int], num_envs: Sequence[int]) -> list[tuple[int, int]]:
    """Lists sizes and numbers of arenas by the cells in a batch, so that peaks of memory rise."""
    return sorted(itertools.product(sizes, num_envs), key=lambda cell: cell[0] ** 2 * cell[1])
