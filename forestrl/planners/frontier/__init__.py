"""Planners that pick one frontier cell as their goal, at every step anew."""
