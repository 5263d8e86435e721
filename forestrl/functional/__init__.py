"""The paper as pure functions of tensors: every equation, table and algorithm once.

All functions take leading batch dimensions ``*B``, including none, and import only torch.
"""

from forestrl.functional.actions import (
    DISPLACEMENTS,
    NULL_ACTION,
    check_action,
    feasible,
    move,
    safe_action,
    sample_action,
    targets,
)
from forestrl.functional.arena import (
    component,
    coverage,
    largest_component,
    rasterize,
    sample_position,
    sample_trees,
)
from forestrl.functional.frontier import frontier, nearest_first
from forestrl.functional.graph import (
    FEATURES,
    WAYPOINT_EDGES,
    WAYPOINTS,
    Graph,
    edges,
    exploration_graph,
    nearest_waypoint,
)
from forestrl.functional.grid import Cell, gather, inside, window_counts, window_counts_at
from forestrl.functional.lidar import SightLines, reveal, scan, sense, sight_lines
from forestrl.functional.paths import path_lengths
from forestrl.functional.reward import distance, information_gain, potential, reward

__all__ = [
    "DISPLACEMENTS",
    "FEATURES",
    "NULL_ACTION",
    "WAYPOINTS",
    "WAYPOINT_EDGES",
    "Cell",
    "Graph",
    "SightLines",
    "check_action",
    "component",
    "coverage",
    "distance",
    "edges",
    "exploration_graph",
    "feasible",
    "frontier",
    "gather",
    "information_gain",
    "inside",
    "largest_component",
    "move",
    "nearest_first",
    "nearest_waypoint",
    "path_lengths",
    "potential",
    "rasterize",
    "reveal",
    "reward",
    "safe_action",
    "sample_action",
    "sample_position",
    "sample_trees",
    "scan",
    "sense",
    "sight_lines",
    "targets",
    "window_counts",
    "window_counts_at",
]
