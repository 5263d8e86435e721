"""Classical planners in the same env, filter and step budget as the learned policy."""

from forestrl.policies.classical.benchmarks import CostBased, PotentialField, Variant
from forestrl.policies.classical.frontier import InformationGain, NearestFrontier, first_move
from forestrl.policies.classical.hindsight import Hindsight
from forestrl.policies.classical.planner import Planner, Reason
from forestrl.policies.classical.random_walk import RandomWalk

__all__ = [
    "CostBased",
    "Hindsight",
    "InformationGain",
    "NearestFrontier",
    "Planner",
    "PotentialField",
    "RandomWalk",
    "Reason",
    "Variant",
    "first_move",
]
