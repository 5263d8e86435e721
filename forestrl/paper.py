"""The paper's own numbers (Sec. III), to stand beside ours; shares, not per cent."""

from collections.abc import Mapping
from typing import Any

ARENA = {"size": 50, "n_trees": 45}
"""Table III: where the numbers of Fig. 3 hold."""
COVERAGE = {1000: 0.80, 2000: 0.95, 2500: 0.97}
"""Fig. 3b, the learned policy: mean coverage by step; h = 50, 45 trunks."""
BENCHMARKS = {"cost": 0.88, "mmpf": 0.78}
"""Fig. 3b: coverage after 2500 steps. The text gives both numbers in the order of the methods."""
INTERVENTION_RATE = 0.10
"""Fig. 3c: mean share of steps with an intervention."""
INTERVENTION_LIMIT, SHARE_UNDER_LIMIT = 0.15, 0.80
"""Fig. 3c: 80 % of the runs have interventions in fewer than 15 % of their steps."""
MORE_THAN = 0.80
"""Fig. 4a, 4b: the coverage passed at :data:`PASSED_AT`."""
PASSED_AT = {"size75": 2500, "size100": 5000, "trees75": 2500}
"""Fig. 4a, 4b: steps after which coverage is over 80 %, by setting."""
DENSE_INTERVENTION_RATE = 0.20
"""Fig. 4c: interventions with 75 trunks, about."""
DIP, FRAMES = 60_000, 400_000
"""Fig. 3a: frames of the small decline, and of the whole training."""


def coverage_of(policy: str, variant: str | None, env: Mapping[str, Any]) -> dict[int, float]:
    """Gives the paper's own numbers for a policy, by step; none outside its arenas (Fig. 3b).

    Args:
        policy: ``learned``, ``cost``, ``mmpf`` or another.
        variant: of the planner; the paper's are as published.
        env: settings of the env.
    """
    if any(env.get(name) != value for name, value in ARENA.items()):
        return {}
    if policy == "learned":
        return COVERAGE
    published = policy in BENCHMARKS and variant == "published"
    return {2500: BENCHMARKS[policy]} if published else {}
