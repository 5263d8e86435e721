"""The signs in the pictures and what they mean."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from forestrl.rendering import panel as P
from forestrl.rendering.panel import Colour, Panel, colours_of
from forestrl.rendering.scene import Scene

_LINE, _SWATCH, _GAP, _LETTERS = 20, 18, 8, 12  # pixels
_MARK = P.INTERVENTION


class Sign(NamedTuple):
    """A sign, in words and as it is drawn."""

    meaning: str
    ground: Colour
    draw: Callable[[Panel], object] = lambda panel: None
    """Draws it; (0, 0) is the middle of the one cell. By default the ground is the sign."""


def legend(signs: Sequence[Sign], width: int) -> Image.Image:
    """Draws signs with their meanings, in as many columns as the width has room for."""
    font = ImageFont.load_default(_LETTERS)
    wide = _SWATCH + _GAP + round(max(font.getlength(sign.meaning) for sign in signs)) + 2 * _GAP
    columns = max(1, width // wide)
    size = (max(width, wide), _LINE * -(-len(signs) // columns))
    picture = Image.new("RGB", size, P.PAPER)
    pen = ImageDraw.Draw(picture)
    for i, sign in enumerate(signs):
        top, left = _LINE * (i // columns), wide * (i % columns)
        swatch = Panel(colours_of(np.zeros((1, 1), int), [sign.ground]), _SWATCH - 2)
        sign.draw(swatch)
        pen.rectangle((left, top + 1, left + _SWATCH - 1, top + _SWATCH), fill=P.PALE)
        picture.paste(swatch.finished(), (left + 1, top + 2))
        words = (left + _SWATCH + _GAP, top + _LINE / 2)
        pen.text(words, sign.meaning, P.INK, font, anchor="lm")
    return picture


def signs_of(scene: Scene) -> list[Sign]:
    """Lists the signs of a picture of one episode: those that can occur in it."""
    filtered, graph = scene.has_filter, scene.has_graph
    stepped_in = Sign("filter stepped in", P.GROUND, lambda p: p.diamond((0, 0), 0.34, _MARK))
    collision = Sign("collision", P.GROUND, lambda p: p.star((0, 0), 0.45, P.COLLISION))
    edge = Sign("graph edge", P.PAPER, lambda p: p.line([(0.5, -0.5), (-0.5, 0.5)], P.EDGE, 1))
    replaced = Sign("replaced action", P.PAPER, lambda p: p.border((0, 0), _MARK, 3))
    return [
        Sign("agent", P.PAPER, lambda p: p.circle((0, 0), 0.3, fill=P.AGENT)),
        Sign("way so far", P.GROUND, _way),
        stepped_in if filtered else collision,
        Sign("sensor range", P.GROUND, _reach),
        Sign("trunk", P.TRUNK),
        Sign("unknown", P.UNKNOWN),
        Sign("known to be free", P.FREE),
        Sign("known to be occupied", P.OCCUPIED),
        Sign("frontier", P.FRONTIER),
        *[edge] * graph,
        Sign("feasible waypoint", P.PAPER, lambda p: p.waypoint((0, 0), feasible=True)),
        Sign("infeasible waypoint", P.PAPER, lambda p: p.waypoint((0, 0), feasible=False)),
        Sign("executed action", P.PAPER, lambda p: p.border((0, 0), P.AGENT, 3)),
        *[replaced] * filtered,
    ]


def _way(panel: Panel) -> None:
    panel.line([(0.3, -0.5), (0, -0.1), (-0.2, 0.5)], P.AGENT, 2)


def _reach(panel: Panel) -> None:
    panel.circle((0.5, -0.5), 0.8, fill=(*P.AGENT, 34), outline=(*P.AGENT, 150))
