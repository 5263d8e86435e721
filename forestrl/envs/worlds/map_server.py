"""Files of ROS's map_server: a YAML file and an image, or an image alone."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from PIL import Image

from forestrl.envs.worlds.grid_map import CellSize, GridMap
from forestrl.envs.worlds.refusals import wrong_field
from forestrl.functional import Cell
from forestrl.settings import Range, allows, describe
from forestrl.storage import atomic_write
from forestrl.wording import written

Colour = Annotated[int, Range(0, 255)]
Share = Annotated[float, Range(0, 1)]
Mode = Literal["trinary", "scale", "raw"]

IMAGES = (".pgm", ".png", ".bmp")
YAMLS = (".yaml", ".yml")
ASSUMED: Mapping[str, Any] = {
    "origin": [0.0, 0.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
    "mode": "trinary",
}
"""What holds for an image without a YAML file, if nothing else is given."""
_FIELDS = {
    "image": str,
    "resolution": CellSize,
    "origin": tuple[float, float, float],
    "negate": Literal[0, 1] | bool,
    "occupied_thresh": Share,
    "free_thresh": Share,
    "mode": Mode,
}
_PIXELS = ("1", "L", "LA", "P", "RGB", "RGBA")  # Pillow's names of what has 8 bits a channel
_GREYS = {Cell.UNKNOWN: 205, Cell.FREE: 254, Cell.OCCUPIED: 0}  # as map_saver writes them


def read_map(
    path: Path,
    given: Mapping[str, Any] | None = None,
    start_colour: tuple[int, int, int] | None = None,
) -> GridMap:
    """Reads a map by the rules of map_server.

    The colours of a pixel are averaged to a grey ``x``; its occupancy is (255 − x)/255, ``x``/255
    with ``negate``, and ``x``/100 in mode ``raw``. A cell is occupied above ``occupied_thresh``,
    free below ``free_thresh``, and unknown in between, in all modes. It is unknown too where a
    pixel is transparent, or above 100 in mode ``raw``. (map_server averages the opacity too in mode
    ``trinary``, so that an unknown pixel of an image with opacity becomes free.)

    Args:
        path: the YAML file, or an image that has none.
        given: fields of the YAML file that hold in place of those in it; of an image alone,
            ``resolution`` and all that differ from :data:`ASSUMED`.
        start_colour: red, green and blue of the pixels that mark the start; they count as free.

    Raises:
        OSError: if a file cannot be read.
        ValueError: if what is in it is not allowed; the message names the file and the field.
    """
    fields = _fields(path, given or {})
    image = path.parent / fields["image"] if is_yaml(path) else path
    pixels = _pixels(image)
    cells = _cells(pixels, fields, path)
    x, y, yaw = map(float, fields["origin"])
    grid = GridMap(cells, float(fields["resolution"]), (x, y, yaw), name=str(path))
    return grid if start_colour is None else _marked(grid, pixels, start_colour, image)


def is_yaml(path: Path) -> bool:
    """Tells whether a file is a YAML file by its name."""
    return path.suffix.lower() in YAMLS


def map_files(path: Path) -> list[Path]:
    """Lists the maps of a folder: YAML files, and images that belong to none.

    Args:
        path: the folder; a file is the only one.

    Raises:
        FileNotFoundError: if there is none.
    """
    if not path.is_dir():
        return [path]
    yamls = sorted(filter(is_yaml, path.iterdir()))
    taken = {path / str(read_yaml(each).get("image")) for each in yamls}
    alone = {each for each in path.iterdir() if each.suffix.lower() in IMAGES} - taken
    if not yamls and not alone:
        suffixes = ", ".join((*YAMLS, *IMAGES))
        raise FileNotFoundError(f"{path}: there is no map in this folder: none of {suffixes}")
    return sorted([*yamls, *alone])


def read_yaml(path: Path) -> dict[str, Any]:
    """Reads the fields of a YAML file.

    Raises:
        ValueError: if it holds none.
    """
    try:
        found = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not YAML: {error}") from error
    if not isinstance(found, dict):
        raise ValueError(f"{path} is not the YAML file of a map: it must hold fields, as image:")
    return found


def write_map(path: Path, grid: GridMap, image: Literal["pgm", "png"] = "pgm") -> None:
    """Writes a map as map_saver does: free cells 254, occupied ones 0, unknown ones 205.

    Args:
        path: the YAML file; the image lies beside it.
        grid: the map.
        image: format of the image.
    """
    greys = np.zeros(len(Cell), np.uint8)
    for state, grey in _GREYS.items():
        greys[state] = grey
    picture, data = path.with_suffix(f".{image}"), io.BytesIO()
    Image.fromarray(greys[grid.cells]).save(data, {"pgm": "PPM", "png": "PNG"}[image])
    fields = {"image": picture.name, "resolution": grid.cell_size, **ASSUMED}
    fields["origin"] = list(grid.origin)
    atomic_write(picture, data.getvalue())
    atomic_write(path, yaml.safe_dump(fields, sort_keys=False, default_flow_style=None))


def assumptions(path: Path, given: Mapping[str, Any]) -> str:
    """Says what is assumed of a map, as nothing says it; nothing of one with a YAML file."""
    if is_yaml(path):
        return ""
    assumed = [f"{name}={written(ASSUMED[name])}" for name in ASSUMED if name not in given]
    return f"assumed, as there is no YAML file: {', '.join(assumed)}" if assumed else ""


def _fields(path: Path, given: Mapping[str, Any]) -> dict[str, Any]:
    """What the YAML file says, or what holds without one, and what was given instead."""
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such file")
    if is_yaml(path):
        fields = {"mode": ASSUMED["mode"], **read_yaml(path), **given}
    else:
        fields = {"image": path.name, **ASSUMED, **given}
        if "resolution" not in given:
            reason = (
                "it must be the metres of a pixel's side, as there is no YAML file that says it"
            )
            raise wrong_field(path, "resolution", None, reason)
    for name, kind in _FIELDS.items():
        if name not in fields:
            raise ValueError(f"{path}: there is no {name}, which is needed: {describe(kind)}")
        if not allows(kind, fields[name]):
            raise wrong_field(path, name, fields[name], f"it must be {describe(kind)}")
    if fields["free_thresh"] > fields["occupied_thresh"]:
        reason = f"it must be at most {fields['occupied_thresh']}, the occupied_thresh"
        raise wrong_field(path, "free_thresh", fields["free_thresh"], reason)
    return fields


def _pixels(path: Path) -> np.ndarray:
    """Reads an image: uint8 ``[H, W, 4]``, red, green, blue and opacity."""
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such image")
    try:
        with Image.open(path) as picture:
            mode = picture.mode
            pixels = np.asarray(picture.convert("RGBA")) if mode in _PIXELS else None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise ValueError(f"{path} cannot be read as an image: {error}") from error
    if pixels is None:
        reason = f"it must be of 8 bits a channel: {', '.join(_PIXELS)} in Pillow's words"
        raise wrong_field(path, "image mode", mode, reason)
    return pixels


def _cells(pixels: np.ndarray, fields: Mapping[str, Any], path: Path) -> np.ndarray:
    """Tells what each pixel says of its cell, uint8 ``[H, W]``."""
    grey, unknown = pixels[..., :3].mean(-1), pixels[..., 3] < 255
    if fields["mode"] == "raw":
        unknown, occupancy = unknown | (grey.round() > 100), grey.round() / 100
    else:
        occupancy = (grey if fields["negate"] else 255 - grey) / 255
    cells = np.full(grey.shape, Cell.UNKNOWN, np.uint8)
    cells[(occupancy > fields["occupied_thresh"]) & ~unknown] = Cell.OCCUPIED
    cells[(occupancy < fields["free_thresh"]) & ~unknown] = Cell.FREE
    if not (cells == Cell.FREE).any():
        least = occupancy[~unknown].min(initial=math.inf)
        reason = f"it leaves no free cell: the least occupancy in the map is {least:.3f}"
        raise wrong_field(path, "free_thresh", fields["free_thresh"], reason)
    return cells


def _marked(grid: GridMap, pixels: np.ndarray, colour: tuple[int, int, int], path: Path) -> GridMap:
    """Lets the robot start in the middle of the pixels of a colour."""
    marked = (pixels[..., :3] == np.array(colour, np.uint8)).all(-1)
    places = np.argwhere(marked)
    if not len(places):
        raise wrong_field(path, "colours", colour, "no pixel has that start_colour")
    middle = places[np.square(places - places.mean(0)).sum(-1).argmin()]
    cells = np.where(marked, np.uint8(Cell.FREE), grid.cells)
    return replace(grid, cells=cells, start=grid.point_at(*middle.tolist()))
