"""How long a decision takes: ``python -m forestrl.planner.latency [FILE.csv]``."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

import numpy as np
import torch

from forestrl.planner import Planner, PlannerStatus
from forestrl.storage import atomic_write, csv_text

SIDES = {50: 200, 200: 100, 1000: 30}
"""Cells along a side, and how many decisions are timed."""
POLICIES = ("nearest_frontier", "path_gain", "linear", "learned")
HEAD = ("policy", "side", "decisions", "median_ms", "percentile_99_ms")


def forest_map(side: int) -> np.ndarray:
    """Gives a map of free cells with single trunks, a third of it unknown: int8 ``[n, n]``."""
    draws = np.random.default_rng(0).random((side, side))
    cells = np.where(draws < 0.02, 100, 0).astype(np.int8)
    cells[2 * side // 3 :] = -1
    return cells


def walk(policy: str, side: int, decisions: int) -> Iterator[float]:
    """Walks by a policy on a map that stays; yields the time of each decision, ms."""
    cells, planner = forest_map(side), Planner(policy, beyond_edge="wall")
    cells[side // 3, side // 2] = 0
    x, y = side // 2 + 0.5, side // 3 + 0.5
    for i in range(decisions + 2):
        grid = {"width": side, "height": side, "resolution": 1.0, "origin": (0, 0), "data": cells}
        before = perf_counter()
        decision = planner.plan(grid, (x, y))
        after = perf_counter()
        if decision.status is not PlannerStatus.EXPLORING or decision.waypoint is None:
            return
        if i >= 2:  # the first compile, and look at the map as a whole
            yield 1000 * (after - before)
        x, y = decision.waypoint


def measured() -> Iterator[tuple[str, int, int, float, float]]:
    """Measures all policies and sizes; yields the rows of the table."""
    torch.set_num_threads(1)
    for policy in POLICIES:
        for side, decisions in SIDES.items():
            times = list(walk(policy, side, decisions))
            median, slow = (float(value) for value in np.percentile(times, (50, 99)))
            yield policy, side, len(times), median, slow


def main() -> None:
    """Prints the table, and writes it where the command line says."""
    table = csv_text([HEAD, *measured()])
    print(table, end="")
    if len(sys.argv) > 1:
        atomic_write(Path(sys.argv[1]), table)


if __name__ == "__main__":
    main()
