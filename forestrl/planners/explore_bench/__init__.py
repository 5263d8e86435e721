"""Explore-Bench's planners, as published and corrected."""
