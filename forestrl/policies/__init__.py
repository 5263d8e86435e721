"""Who decides: the GATv2 policy, the classical planners, and the released policies."""
