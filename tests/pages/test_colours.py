"""The colours of pages and pictures, as readers who see few colours and grey printers have them."""

import re
from itertools import combinations

import numpy as np
import pytest

from forestrl.pages.page import asset
from forestrl.rendering import panel as P

# Machado, Oliveira and Fernandes 2009, severity 1, on linear RGB; grey is the relative luminance.
SIGHTS = {
    "all colours": np.eye(3),
    "protanopia": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "deuteranopia": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "tritanopia": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
    "grey": [[0.2126, 0.7152, 0.0722]] * 3,
}
TO_XYZ = np.array(
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
) / [[0.9505], [1.0], [1.089]]
APART = 10.0  # CIE76, in which 2.3 is just noticeable


def linear(colour):
    share = np.asarray(colour) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def lab(colour, sight):
    x, y, z = np.cbrt(TO_XYZ @ np.clip(np.array(SIGHTS[sight]) @ linear(colour), 0, 1))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def schemes():
    """The palettes of the pages: light, and what dark changes of it."""
    light, dark = re.split("@media", asset("look.css"), maxsplit=1)

    def paints(text):
        found = re.findall(r"--([\w-]+): #([0-9a-f]{6})(?![0-9a-f])", text)
        return {name: tuple(bytes.fromhex(value)) for name, value in found}

    return {"light": paints(light), "dark": paints(light) | paints(dark)}


CELLS = {
    **{name: [paints[each] for each in ("unknown", "free", "trunk", "frontier")]
       for name, paints in schemes().items()},
    **{f"{name}, forest": [paints[each] for each in ("ground", "trunk", "veil", "hidden")]
       for name, paints in schemes().items()},
    "picture, map": [P.UNKNOWN, P.FREE, P.OCCUPIED, P.FRONTIER],
    "picture, arena": [P.GROUND, P.TRUNK, P.UNKNOWN],
}  # fmt: skip


@pytest.mark.parametrize("sight", SIGHTS)
@pytest.mark.parametrize("name", CELLS)
def test_cells_that_mean_different_things_are_told_apart(name, sight):
    for one, other in combinations(CELLS[name], 2):
        apart = np.linalg.norm(lab(one, sight) - lab(other, sight))
        assert apart >= APART, (one, other, apart)


def test_the_measure_of_colours_is_right():
    assert lab((255, 255, 255), "all colours") == pytest.approx([100, 0, 0], abs=0.1)
    assert lab((255, 0, 0), "all colours") == pytest.approx([53.2, 80.1, 67.2], abs=0.3)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("ink", ["ink", "soft", "accent", "intervention", "policy-0", "policy-2"])
def test_words_stand_out_from_their_ground(scheme, ink):
    paints = schemes()[scheme]
    for ground in ("paper", "card"):
        levels = [SIGHTS["grey"][0] @ linear(paints[each]) for each in (ink, ground)]
        assert (max(levels) + 0.05) / (min(levels) + 0.05) >= 4.5
