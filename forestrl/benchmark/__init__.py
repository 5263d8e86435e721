"""How fast each part of a training is on this machine, and how its cost grows with the work."""
