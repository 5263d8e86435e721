"""Numbers measured elsewhere, to stand beside ours; shares. No command here remakes them."""

from __future__ import annotations

from typing import NamedTuple

from forestrl import paper as P
from forestrl.publishing.statistics import Interval


class Elsewhere(NamedTuple):
    """A policy's numbers from another source.

    Attributes:
        label: the source and the policy.
        unit: what was run there; empty where it is not known.
        values: numbers by name, as :func:`forestrl.publishing.results.measure` calls them.
    """

    label: str
    unit: str
    values: dict[str, Interval]


def _numbers(**values: float) -> dict[str, Interval]:
    return {name: Interval(value) for name, value in values.items()}


_SIMULATOR = "Explore-Bench's own simulator"
_RUNS = 40
_SIMULATED: dict[str, dict[str, float]] = {
    "cost-based": {
        "covered": 26 / _RUNS,
        "cycle": 10 / _RUNS,
        "at_goal": 3 / _RUNS,
        "no_reachable_frontier": 1 / _RUNS,
    },
    "MMPF": {"covered": 19 / _RUNS, "cycle": 19 / _RUNS, "goal_not_free": 2 / _RUNS},
}
_PLAIN = "a plain program"
_LEARNED = _numbers(intervention_rate=P.INTERVENTION_RATE, percentile_80=P.INTERVENTION_LIMIT)


def _simulated(
    planner: str, early: tuple[float, float], *, end: float, standard_error: float
) -> Elsewhere:
    """A planner in the simulator: coverage at 250 and 500 steps, and from 1000 on."""
    margin = 1.96 * standard_error
    values = _numbers(coverage_250=early[0], coverage_500=early[1])
    values |= _numbers(coverage_1000=end, coverage_2000=end)
    values |= {"coverage_2500": Interval(end, end - margin, end + margin)}
    values |= _numbers(reached_98=_SIMULATED[planner]["covered"])
    return Elsewhere(f"{_SIMULATOR}: {planner}", f"{_RUNS} arenas", values)


BESIDE: dict[str, tuple[Elsewhere, ...]] = {
    "learned": (
        Elsewhere(
            "paper: GATv2 and PPO",
            "",
            {f"coverage_{step}": Interval(share) for step, share in P.COVERAGE.items()} | _LEARNED,
        ),
    ),
    "cost_published": (
        Elsewhere("paper: cost-based", "", _numbers(coverage_2500=P.BENCHMARKS["cost"])),
        _simulated("cost-based", (0.632, 0.822), end=0.825, standard_error=0.050),
    ),
    "mmpf_published": (
        Elsewhere("paper: MMPF", "", _numbers(coverage_2500=P.BENCHMARKS["mmpf"])),
        _simulated("MMPF", (0.707, 0.802), end=0.803, standard_error=0.041),
    ),
    "nearest_frontier": (
        Elsewhere(
            f"{_PLAIN}: nearest frontier",
            "300 arenas",
            _numbers(coverage_250=0.72, coverage_500=0.99, coverage_1000=1.0, steps_to_98=419),
        ),
    ),
    "information_gain": (
        Elsewhere(
            f"{_PLAIN}: information gain",
            "300 arenas",
            _numbers(coverage_250=0.82, coverage_500=0.99, coverage_1000=1.0, steps_to_98=396),
        ),
    ),
    "random": (
        Elsewhere(
            f"{_PLAIN}: random walk",
            "300 arenas",
            _numbers(coverage_250=0.17, coverage_500=0.24, coverage_1000=0.35),
        ),
    ),
}
"""What stands after a policy's row in the headline table.

The paper's numbers are those of its Sec. III. Explore-Bench's grid simulator, at its commit ce3b98a
and with its planning as it is, was run in 40 forests of 50 x 50 cells with a wall around them; its
LiDAR sees a square of 10 x 10 cells, trunks there have integer centres and radii, and coverage is
of all free cells. The plain program was written without this code
and run in 300 other forests of Table III; its rule for ties is not ours.
"""

ENDINGS = {
    "cost_published": (f"{_SIMULATOR}: cost-based", _RUNS, _SIMULATED["cost-based"]),
    "mmpf_published": (f"{_SIMULATOR}: MMPF", _RUNS, _SIMULATED["MMPF"]),
}
"""How the same runs ended, and how many; after the row of the planner that does the same here."""
