"""Classical planners in the same env, filter and step budget as the learned policies."""

from forestrl.planners.base import ClassicalPlanner
from forestrl.planners.explore_bench.planners import CostBased, PotentialField
from forestrl.planners.frontier.information_gain import InformationGain
from forestrl.planners.frontier.nearest import NearestFrontier
from forestrl.planners.hindsight.planner import Hindsight
from forestrl.planners.random_walk import RandomWalk
from forestrl.planners.viewpoints.path_gain import PathGain

__all__ = [
    "ClassicalPlanner",
    "CostBased",
    "Hindsight",
    "InformationGain",
    "NearestFrontier",
    "PathGain",
    "PotentialField",
    "RandomWalk",
]
