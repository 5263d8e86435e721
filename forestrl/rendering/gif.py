"""Pictures as a moving one, written as they come."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.GifImagePlugin import getdata, getheader

from forestrl.rendering import panel as P
from forestrl.rendering.panel import Colour
from forestrl.storage import atomic_file

_DRAWN = (
    *(P.INK, P.PAPER, P.FAINT, P.PALE, P.GROUND, P.TRUNK, P.UNKNOWN, P.VEILED, P.OCCUPIED),
    *(P.SOLID, P.EDGE, P.FRONTIER, P.AGENT, P.FEASIBLE, P.INFEASIBLE, P.INTERVENTION),
)
_PAINTED = (P.AGENT, P.FEASIBLE, P.INFEASIBLE, P.INTERVENTION, P.INK)
_GROUNDS = (P.PAPER, P.GROUND, P.TRUNK, P.UNKNOWN, P.VEILED, P.OCCUPIED, P.SOLID, P.FRONTIER)
_SHARES = (34 / 255, 1 / 3, 2 / 3)
_NEAR = 5  # of 255: a colour between others that is as near as this to one of them is left out
_PAUSE = 1500  # ms, before it starts again
_SHORTEST = 20  # ms; viewers slow shorter ones down


def write_gif(pictures: Iterable[Image.Image], path: str | os.PathLike[str], fps: float) -> Path:
    """Writes pictures as a GIF that loops, each as it comes; only two of them are kept at a time.

    All have one palette, of the colours that are drawn with here; of each picture only what differs
    from the one before is written.

    Args:
        pictures: RGB, of one size.
        path: the file; it appears when it is whole.
        fps: pictures a second; GIF rounds to hundredths of a second a picture.

    Returns:
        the path.

    Raises:
        ValueError: if there are no pictures, their sizes differ, or ``fps`` is not positive.
    """
    if fps <= 0:
        raise ValueError(f"fps={fps} is not allowed: it must be more than 0")
    duration = max(_SHORTEST, round(100 / fps) * 10)
    with atomic_file(path) as file:
        changes = _changes(pictures)
        last = next(changes, None)
        if last is None:
            raise ValueError("pictures of one size are needed, got none")
        file.writelines(getheader(last[0], info={"loop": 0, "duration": duration})[0])
        for change in changes:
            file.writelines(_encoded(*last, duration))
            last = change
        file.writelines(_encoded(*last, duration + _PAUSE))
        file.write(b";")
    return Path(path)


def _encoded(change: Image.Image, place: tuple[int, int], duration: int) -> list[bytes]:
    """Gives a picture as a part of a GIF; what it does not change stays."""
    return getdata(change, place, duration=duration, disposal=1, transparency=_CLEAR)


def _changes(
    pictures: Iterable[Image.Image],
) -> Iterator[tuple[Image.Image, tuple[int, int]]]:
    """Gives what changes from picture to picture, clear where nothing does, and its upper left."""
    before: NDArray[np.uint8] | None = None
    for picture in pictures:
        now = np.asarray(picture.quantize(palette=_PALETTE, dither=Image.Dither.NONE))
        if before is None:
            before = np.full_like(now, _CLEAR)
        if now.shape != before.shape:
            sizes = [before.shape[::-1], picture.size]
            raise ValueError(f"pictures of one size are needed, got {sizes}")
        differs = now != before
        rows, columns = differs.any(1).nonzero()[0], differs.any(0).nonzero()[0]
        box = slice(0, 1), slice(0, 1)  # a GIF has no empty pictures
        if len(rows):
            box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        change = Image.fromarray(np.where(differs, now, np.uint8(_CLEAR))[box])
        change.putpalette(_PALETTE.getpalette() or [])
        yield change, (int(box[1].start), int(box[0].start))
        before = now


def _make_palette() -> tuple[Image.Image, int]:
    """Takes the colours that are drawn with, and those between them, where lines are smooth.

    Returns:
        the palette, and the first number in it that is no colour: what is clear.
    """
    colours: list[Colour] = [*_DRAWN]
    for share, colour, ground in product(_SHARES, _PAINTED, _GROUNDS):
        pairs = zip(colour, ground, strict=True)
        between = tuple(round(share * a + (1 - share) * b) for a, b in pairs)
        if all(max(abs(a - b) for a, b in zip(between, c, strict=True)) > _NEAR for c in colours):
            colours.append(between)
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.array(colours, dtype=np.uint8).tobytes())
    return palette, len(colours)


_PALETTE, _CLEAR = _make_palette()
