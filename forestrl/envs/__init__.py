"""The world as TorchRL sees it: the forest, and the paper's three contributions as transforms."""

from collections.abc import Mapping

from torchrl.envs.transforms import Transform

from forestrl.envs.forest import ForestEnv
from forestrl.envs.graph import ExplorationGraph
from forestrl.envs.reward import FrontierPotentialReward
from forestrl.envs.safety import SafetyFilter
from forestrl.envs.training import StaggeredEpisodes
from forestrl.envs.worlds import (
    GridMap,
    HardCoreForest,
    MapFiles,
    MappedWorld,
    Plantation,
    PoissonForest,
    RandomForest,
    StemPlot,
    World,
    draw_map,
    read_map,
    write_map,
)

OBSERVATIONS: Mapping[str, type[Transform]] = {"exploration_graph": ExplorationGraph}
"""The observations that a policy file may name."""
WORLDS: Mapping[str, type[World]] = {
    "random_forest": RandomForest,
    "poisson_forest": PoissonForest,
    "hard_core_forest": HardCoreForest,
    "plantation": Plantation,
    "stem_plot": StemPlot,
    "map_files": MapFiles,
}
"""The sources of worlds that a policy file may name."""

__all__ = [
    "OBSERVATIONS",
    "WORLDS",
    "ExplorationGraph",
    "ForestEnv",
    "FrontierPotentialReward",
    "GridMap",
    "HardCoreForest",
    "MapFiles",
    "MappedWorld",
    "Plantation",
    "PoissonForest",
    "RandomForest",
    "SafetyFilter",
    "StaggeredEpisodes",
    "StemPlot",
    "World",
    "draw_map",
    "read_map",
    "write_map",
]
