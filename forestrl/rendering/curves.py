"""Coverage over the steps of several episodes, as far as they have come."""

from __future__ import annotations

import math
from collections.abc import Sequence

from PIL import Image, ImageDraw, ImageFont

from forestrl.rendering import panel as P
from forestrl.rendering.panel import Colour, Point

_HEIGHT, _LEFT, _TOP, _BELOW, _RIGHT = 104, 46, 8, 20, 18  # pixels
_FINE = 3  # drawn this much larger and then reduced, for smooth lines
_LETTERS, _DOT = 12, 3.5  # pixels: size of letters, radius of a dot
_LEVELS = (0.0, 0.5, 1.0)


def draw_curves(
    curves: Sequence[Sequence[float]],
    colours: Sequence[Colour],
    *,
    steps: int,
    goal: float,
    width: int,
) -> Image.Image:
    """Draws coverage curves above one another, with the goal and a cursor at the present step.

    Args:
        curves: the coverage after 0, 1, 2, ... steps, of each episode.
        colours: of the curves.
        steps: the last step that there is room for.
        goal: ``rho*``, drawn as a dashed line.
        width: of the picture, pixels.
    """
    picture = Image.new("RGB", (width * _FINE, _HEIGHT * _FINE), P.PAPER)
    pen = ImageDraw.Draw(picture)

    def across(step: float) -> float:
        return _LEFT + (width - _LEFT - _RIGHT) * step / steps

    def line(points: Sequence[Point], colour: Colour, thick: int = 1) -> None:
        xy = [((x + 0.5) * _FINE - 0.5, (y + 0.5) * _FINE - 0.5) for x, y in points]
        pen.line(xy, fill=colour, width=thick * _FINE, joint="curve")

    for level in _LEVELS:
        line([(across(0), _down(level)), (across(steps), _down(level))], P.PALE)
    for i in range(0, 100, 2):
        ends = (across(steps * i / 100), across(steps * (i + 1) / 100))
        line([(end, round(_down(goal))) for end in ends], P.FAINT)
    now = round(across(max(map(len, curves)) - 1))
    line([(now, _down(0.0)), (now, _down(1.0))], P.FAINT)
    for curve, colour in zip(curves, colours, strict=True):
        points = [(across(step), _down(coverage)) for step, coverage in enumerate(curve)]
        line(points, colour, 2)
        x, y = points[-1]
        box = (x - _DOT, y - _DOT, x + 1 + _DOT, y + 1 + _DOT)
        pen.ellipse([_FINE * edge for edge in box], fill=colour)
    picture = picture.reduce(_FINE)
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(_LETTERS)
    for level in _LEVELS:
        pen.text((_LEFT - 8, _down(level)), f"{100 * level:.0f} %", P.INK, font, anchor="rm")
    for step in range(0, steps + 1, tick_spacing(steps)):
        pen.text((across(step), _down(0.0) + 4), f"{step}", P.INK, font, anchor="mt")
    return picture


def _down(coverage: float) -> float:
    return _HEIGHT - _BELOW - (_HEIGHT - _BELOW - _TOP) * coverage


def tick_spacing(steps: int) -> int:
    """Gives the smallest of 1, 2, 5, 10, 20, 50, ... that needs no more than six ticks after 0.

    >>> [tick_spacing(steps) for steps in (1, 7, 300, 2500)]
    [1, 2, 50, 500]
    """
    unit = 10 ** max(0, math.floor(math.log10(steps / 6)))
    return next(digit * unit for digit in (1, 2, 5, 10) if steps <= 6 * digit * unit)
