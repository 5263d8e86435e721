"""How views, titles and captions share a picture, whatever the shape of the arena."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from PIL import Image, ImageDraw, ImageFont

from forestrl.rendering import panel as P
from forestrl.rendering.panel import Colour

_GAP, _LINE, _LETTERS = 16, 26, 15  # pixels: between parts, a line of text, size of letters
_FRAME = 3  # pixels: room around a view for its frame
_LEAST, _MOST = 2, 32  # pixels a cell


class Grid(NamedTuple):
    """How views of arenas stand in a room."""

    columns: int
    scale: int
    """Side of a cell, pixels."""


class Entry(NamedTuple):
    """A text of a caption."""

    text: str
    longest: str
    """The longest that may stand in its place."""


def fitting_grid(views: int, shape: Sequence[int], width: int, height: int) -> Grid:
    """Finds the columns in which views of arenas are largest.

    Args:
        views: how many.
        shape: rows and columns of the arena, cells.
        width: of the room, pixels.
        height: of the room, pixels.

    Returns:
        the columns, and the scale at which the views fit into the room; arenas so large or small
        that a cell would be less than 2 or more than 32 pixels wide take more or less of it.
    """

    def fit(columns: int) -> float:
        across = width / columns - _GAP
        down = height / math.ceil(views / columns) - _GAP - _LINE
        return min(across / shape[1], down / shape[0])

    best = max(range(1, views + 1), key=fit)
    return Grid(best, max(_LEAST, min(_MOST, int(fit(best)))))


def row(*parts: Image.Image) -> Image.Image:
    """Puts pictures side by side, their upper edges in line."""
    size = (sum(p.width for p in parts) + _GAP * (len(parts) - 1), max(p.height for p in parts))
    picture, left = Image.new("RGB", size, P.PAPER), 0
    for part in parts:
        picture.paste(part, (left, 0))
        left += part.width + _GAP
    return picture


def column(*parts: Image.Image, gap: int = _GAP // 2) -> Image.Image:
    """Puts pictures below one another, their left edges in line."""
    size = (max(p.width for p in parts), sum(p.height for p in parts) + gap * (len(parts) - 1))
    picture, top = Image.new("RGB", size, P.PAPER), 0
    for part in parts:
        picture.paste(part, (0, top))
        top += part.height + gap
    return picture


def grid(parts: Sequence[Image.Image], columns: int) -> Image.Image:
    """Puts pictures of one size into rows of so many columns."""
    rows = range(0, len(parts), columns)
    return column(*(row(*parts[first : first + columns]) for first in rows))


def padded(picture: Image.Image) -> Image.Image:
    """Puts paper around a picture."""
    page = Image.new("RGB", (picture.width + 2 * _GAP, picture.height + 2 * _GAP), P.PAPER)
    page.paste(picture, (_GAP, _GAP))
    return page


def framed(view: Image.Image, highlight: Colour | None = None) -> Image.Image:
    """Puts a frame around a view: a faint one, or a strong one in a colour."""
    line = 1 if highlight is None else _FRAME
    picture = Image.new("RGB", (view.width + 2 * _FRAME, view.height + 2 * _FRAME), P.PAPER)
    edge = (_FRAME - line, _FRAME - line)
    corner = (_FRAME + view.width + line - 1, _FRAME + view.height + line - 1)
    ImageDraw.Draw(picture).rectangle((*edge, *corner), fill=highlight or P.FAINT)
    picture.paste(view, (_FRAME, _FRAME))
    return picture


def titled(names: Sequence[str], picture: Image.Image) -> Image.Image:
    """Puts a title above a picture: the first name that is not wider than it, else the last."""
    font = ImageFont.load_default(_LETTERS)
    name = next((each for each in names if font.getlength(each) <= picture.width), names[-1])
    return column(caption([Entry(name, name)], picture.width), picture, gap=0)


def caption(entries: Sequence[Entry], width: int, colour: Colour = P.INK) -> Image.Image:
    """Writes texts into lines. No text moves, and the picture keeps its size, when one changes.

    Args:
        entries: the texts.
        width: of the lines, pixels; a text that is longer gets a wider picture.
        colour: of the letters.
    """
    font = ImageFont.load_default(_LETTERS)
    rooms = [math.ceil(font.getlength(entry.longest)) for entry in entries]
    places, left, line = [], 0, 0
    for room in rooms:
        if left > 0 and left + room > width:
            left, line = 0, line + 1
        places.append((left, (line + 0.5) * _LINE))
        left += room + _GAP
    picture = Image.new("RGB", (max(width, *rooms), _LINE * (line + 1)), P.PAPER)
    pen = ImageDraw.Draw(picture)
    for place, entry in zip(places, entries, strict=True):
        pen.text(place, entry.text, colour, font, anchor="lm")
    return picture
