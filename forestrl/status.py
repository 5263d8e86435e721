"""Why a decision-maker stays where it is."""

from enum import IntEnum


class Status(IntEnum):
    """What a planner does at a step: it explores, or it stays for one of these reasons."""

    EXPLORING = 0
    """It moves on."""
    COVERED = 1
    """No known free cell has an unknown 8-neighbour."""
    NO_REACHABLE_FRONTIER = 2
    """There is something left, but nothing the planner's own rule finds and can reach."""
    CYCLE = 3
    """Position and map repeat: it would go round for ever."""
    AT_GOAL = 4
    """Its goal is the cell it stands on."""
    GOAL_NOT_FREE = 5
    """Its goal is a tree or lies outside the arena."""
