"""Where episodes take place: forests that are drawn, forests that were measured, and maps."""

from forestrl.envs.worlds.densities import HardCoreForest, Plantation, PoissonForest
from forestrl.envs.worlds.grid_map import GridMap
from forestrl.envs.worlds.map_files import MapFiles
from forestrl.envs.worlds.map_server import read_map, write_map
from forestrl.envs.worlds.mapped import MappedWorld
from forestrl.envs.worlds.random_forest import RandomForest
from forestrl.envs.worlds.source import World, draw_map
from forestrl.envs.worlds.stems import StemPlot

__all__ = [
    "GridMap",
    "HardCoreForest",
    "MapFiles",
    "MappedWorld",
    "Plantation",
    "PoissonForest",
    "RandomForest",
    "StemPlot",
    "World",
    "draw_map",
    "read_map",
    "write_map",
]
