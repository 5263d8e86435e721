"""The world as TorchRL sees it: the forest, and the paper's three contributions as transforms."""

from forestrl.envs.forest import ForestEnv, sample_arena
from forestrl.envs.training import StaggeredEpisodes
from forestrl.envs.transforms import ExplorationGraph, FrontierPotentialReward, SafetyFilter

__all__ = [
    "ExplorationGraph",
    "ForestEnv",
    "FrontierPotentialReward",
    "SafetyFilter",
    "StaggeredEpisodes",
    "sample_arena",
]
