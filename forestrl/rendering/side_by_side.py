"""Several policies in the same arena, in step, in one picture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from PIL import Image

from forestrl.rendering import panel as P
from forestrl.rendering.captions import coverage, outcome, safety
from forestrl.rendering.curves import draw_curves
from forestrl.rendering.layout import (
    Entry,
    caption,
    column,
    fitting_grid,
    framed,
    grid,
    padded,
)
from forestrl.rendering.legend import Sign, legend
from forestrl.rendering.scene import Scene
from forestrl.rendering.views import draw_arena

_ROOM = (856, 470)  # pixels, for two views
_COLOURS = (P.AGENT, P.FEASIBLE, P.INTERVENTION, P.INK)  # of the policies
_SIGNS = (
    Sign("known to be free", P.GROUND),
    Sign("trunk", P.TRUNK),
    Sign("frontier", P.FRONTIER),
    Sign("not seen yet", P.UNKNOWN),
    Sign("trunk, not seen yet", P.VEILED),
)


def draw_side_by_side(
    scenes: Mapping[str, Scene], steps: int, scale: int | None = None
) -> Image.Image:
    """Draws scenes of several episodes in the same arena.

    Each policy has a view of the arena, darkened where it has not seen it yet, and below all of
    them stands the coverage so far.

    Args:
        scenes: what is drawn, under the policies' names.
        steps: the last step that there is room for.
        scale: side of a cell, pixels; None for one that suits the arena.

    Returns:
        an RGB picture; of the same size for all scenes of the same episodes.
    """
    first = next(iter(scenes.values()))
    width, height = _ROOM
    fit = fitting_grid(len(scenes), first.cells.shape, width, height * math.ceil(len(scenes) / 2))
    colours = [_COLOURS[i % len(_COLOURS)] for i in range(len(scenes))]
    views = []
    for (name, scene), colour in zip(scenes.items(), colours, strict=True):
        view = framed(draw_arena(scene, scale or fit.scale, veiled=True, agent=colour))
        title = caption((Entry(name, name), coverage(scene)), view.width, colour)
        below = caption((safety(scene), outcome(scene)), view.width)
        views.append(column(column(title, view, gap=0), below))
    together = grid(views, fit.columns)
    curves = draw_curves(
        [scene.curve for scene in scenes.values()],
        colours,
        steps=steps,
        goal=first.coverage_goal,
        width=max(together.width, 320),
    )
    return padded(column(together, curves, legend(_SIGNS, curves.width)))


def in_step(episodes: Mapping[str, Iterator[Scene]]) -> Iterator[dict[str, Scene]]:
    """Goes through episodes together; one that has ended stays at its last scene.

    Args:
        episodes: by name, none of them empty.

    Yields:
        a scene of each.

    Examples:
        >>> [*in_step({"a": iter("123"), "b": iter("45")})]
        [{'a': '1', 'b': '4'}, {'a': '2', 'b': '5'}, {'a': '3', 'b': '5'}]
    """
    scenes = {name: next(episode) for name, episode in episodes.items()}
    following = scenes
    while following:
        scenes = {**scenes, **following}
        yield scenes
        reached = ((name, next(episode, None)) for name, episode in episodes.items())
        following = {name: scene for name, scene in reached if scene is not None}
