"""The exploration of forests as a Gymnasium environment.

Importing this module registers it, and imports nothing slow::

    import gymnasium
    import forestrl.gymnasium

    env = gymnasium.make("ForestRL/Exploration-v0")

``gymnasium.make("forestrl.gymnasium:ForestRL/Exploration-v0")`` needs no second import. The
settings are those of :class:`forestrl.gymnasium.exploration.Exploration`.
"""

import gymnasium

ID = "ForestRL/Exploration-v0"
"""The name that ``gymnasium.make`` takes."""

gymnasium.register(ID, "forestrl.gymnasium.exploration:Exploration")
