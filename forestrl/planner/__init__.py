"""What a robot calls: from occupancy grid and pose to the next waypoint, and why."""

from forestrl.planner.cells import CellPlanner, Step
from forestrl.planner.decision import Decision, PlannerStatus
from forestrl.planner.grid import BadInputError, Grid
from forestrl.planner.planner import Planner

__all__ = ["BadInputError", "CellPlanner", "Decision", "Grid", "Planner", "PlannerStatus", "Step"]
