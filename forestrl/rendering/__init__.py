"""Pictures of an episode: the hidden arena, the agent's map beside it, and the decision at hand."""

from forestrl.rendering.episode import record_episode, write_gif
from forestrl.rendering.frame import draw_frame

__all__ = ["draw_frame", "record_episode", "write_gif"]
