"""One scene as a picture: the hidden arena, the agent's map, the decision and the legend."""

from __future__ import annotations

from PIL import Image

from forestrl.rendering import panel as P
from forestrl.rendering.captions import coverage, outcome, safety, step
from forestrl.rendering.layout import (
    caption,
    column,
    fitting_grid,
    framed,
    grid,
    padded,
    row,
    titled,
)
from forestrl.rendering.legend import legend, signs_of
from forestrl.rendering.scene import Scene
from forestrl.rendering.views import draw_arena, draw_decision, draw_map

_ROOM = (740, 440)  # pixels, for arena and map together
_LEGEND = 160  # pixels
_TITLES = (("Arena (hidden from the agent)", "Arena"), ("Agent's map",))


def draw_frame(scene: Scene, scale: int | None = None) -> Image.Image:
    """Draws one scene of an episode.

    The hidden arena and the agent's map with the exploration graph stand side by side, or below one
    another where they are wide; on the right are the eight waypoints at large. The frames around
    arena and map turn purple when the filter steps in, and red in a collision.

    Args:
        scene: what is drawn.
        scale: side of a cell, pixels; None for one that suits the arena.

    Returns:
        an RGB picture; of the same size for every scene of an episode.
    """
    fit = fitting_grid(2, scene.cells.shape, *_ROOM)
    scale = fit.scale if scale is None else scale
    strong = P.INTERVENTION if scene.intervened else P.COLLISION if scene.collided else None
    drawn = (draw_arena(scene, scale), draw_map(scene, scale))
    tiles = [
        titled(names, framed(view, strong)) for names, view in zip(_TITLES, drawn, strict=True)
    ]
    views = grid(tiles, fit.columns)
    entries = [step(scene), coverage(scene), safety(scene), outcome(scene)]
    side = column(titled(("Decision",), draw_decision(scene)), legend(signs_of(scene), _LEGEND))
    return padded(row(column(views, caption(entries, views.width)), side))
