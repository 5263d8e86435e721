"""Maps drawn as text, and their files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from PIL import Image

from forestrl.envs import GridMap
from forestrl.functional import Cell

DATA = Path(__file__).parents[1] / "data" / "worlds"
LETTERS = {"?": Cell.UNKNOWN, ".": Cell.FREE, "T": Cell.OCCUPIED}
FIELDS = {
    "image": "map.png",
    "resolution": 0.5,
    "origin": [1.0, -2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def drawn(text, cell_size=1.0, **fields):
    """A map out of a drawing; its first line is the largest y."""
    lines = [line.split() for line in text.strip().splitlines()]
    cells = np.array([[LETTERS[letter] for letter in line] for line in lines], np.uint8)
    return GridMap(cells, cell_size, **fields)


def drawing(grid):
    letters = {state: letter for letter, state in LETTERS.items()}
    return "\n".join(" ".join(letters[state] for state in row) for row in grid.cells.tolist())


def save(folder, pixels, **fields):
    """Writes a map's two files; a field of None is left out. Gives the YAML file."""
    Image.fromarray(np.asarray(pixels, np.uint8)).save(folder / "map.png")
    fields = {name: value for name, value in (FIELDS | fields).items() if value is not None}
    (folder / "map.yaml").write_text(yaml.safe_dump(fields))
    return folder / "map.yaml"


cells = arrays(
    np.uint8, array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.integers(0, 2)
)
origins = st.tuples(*[st.floats(-50, 50)] * 2, st.floats(-4, 4))
