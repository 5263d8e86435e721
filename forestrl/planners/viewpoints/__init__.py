"""Planners that go where most is to be seen, on the way and at its end."""
