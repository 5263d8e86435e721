"""The world as TorchRL sees it: the forest, and the paper's three contributions as transforms."""

from collections.abc import Mapping

from torchrl.envs.transforms import Transform

from forestrl.envs.forest import ForestEnv
from forestrl.envs.graph import ExplorationGraph
from forestrl.envs.reward import FrontierPotentialReward
from forestrl.envs.safety import SafetyFilter
from forestrl.envs.training import StaggeredEpisodes
from forestrl.envs.worlds import RandomForest, World

OBSERVATIONS: Mapping[str, type[Transform]] = {"exploration_graph": ExplorationGraph}
"""The observations that a policy file may name."""
WORLDS: Mapping[str, type[World]] = {"random_forest": RandomForest}
"""The sources of worlds that a policy file may name."""

__all__ = [
    "OBSERVATIONS",
    "WORLDS",
    "ExplorationGraph",
    "ForestEnv",
    "FrontierPotentialReward",
    "RandomForest",
    "SafetyFilter",
    "StaggeredEpisodes",
    "World",
]
