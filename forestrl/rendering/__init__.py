"""Pictures of episodes, drawn as they are played, and written as they are drawn.

A picture is a function of a scene::

    scenes = play(env, policy, steps=500, every=4)
    write_gif((draw_frame(scene) for scene in scenes), "episode.gif", fps=12)
"""

from forestrl.rendering.frame import draw_frame
from forestrl.rendering.gif import write_gif
from forestrl.rendering.scene import Scene, play
from forestrl.rendering.side_by_side import draw_side_by_side, in_step

__all__ = ["Scene", "draw_frame", "draw_side_by_side", "in_step", "play", "write_gif"]
