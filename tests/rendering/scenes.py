"""One drawn situation as a scene, and pictures to look at closely."""

import numpy as np
import torch
from PIL import Image, ImageChops, ImageDraw, ImageFont
from tensordict import TensorDict

from forestrl import keys as K
from forestrl.rendering import Scene
from forestrl.rendering import panel as P
from forestrl.rendering.scene import Trail
from tests.drawing import situation

SCALE = 20
DRAWING = """
    ? ? ? ? ? ? ? ? ?
    ? ? ? ? ? ? ? ? ?
    . . . . . . ? ? ?
    . . . T . . ? ? ?
    . . . . . . . ? ?
    . . A . . . . ? ?
    . . T . . . T ? ?
"""
NORTH_WEST, WEST, EAST, SOUTH_WEST, SOUTH = 1, 4, 5, 6, 7  # of the agent; south is a trunk


def step(**entries):
    """The drawing as a state that a policy has not seen yet; trunks are where it has them."""
    cells, position = situation(DRAWING)
    td = TensorDict(
        {
            K.TREES: cells == 2,
            K.CELLS: cells,
            K.POSITION: position,
            K.COVERAGE: torch.tensor([0.5]),
            K.STEP_COUNT: torch.tensor([12]),
            K.COLLISION: torch.tensor([False]),
        }
    )
    return td.update({key: torch.as_tensor(value) for key, value in entries.items()})


def acted(action, executed=None):
    """The step with an action; with a filter if it is said what that executed."""
    td = step(action=action)
    if executed is None:
        return td.set(("next", *K.COLLISION), torch.tensor([action == SOUTH]))
    td.set(K.INTERVENED, torch.tensor([False]))
    td.set(("next", *K.EXECUTED), torch.tensor(executed))
    td.set(("next", *K.COLLISION), torch.tensor([False]))
    return td.set(("next", *K.INTERVENED), torch.tensor([executed != action]))


def scene(td=None, trail=None, **task):
    """A scene of a step, by default of the bare drawing."""
    task = {"lidar_range": 1.0, "coverage_goal": 0.98} | task
    return Scene(step() if td is None else td, Trail() if trail is None else trail, **task)


def colour(view, row, col):
    """The colour of the middle of a cell."""
    return view.getpixel((int((col + 0.5) * SCALE), int((row + 0.5) * SCALE)))


def count(picture, of):
    """How many pixels have exactly this colour."""
    return int((np.asarray(picture) == of).all(-1).sum())


def places(part, picture):
    """Where a picture contains another one: all (left, top)."""
    part, picture = (
        np.asarray(each).astype(np.int32) @ [1 << 16, 1 << 8, 1] for each in (part, picture)
    )
    height, width = part.shape
    rows, columns = picture.shape[0] - height + 1, picture.shape[1] - width + 1
    if min(rows, columns) < 1:
        return []
    drawn = np.argwhere(part != part.max())  # paper is the lightest
    few = drawn[:: max(1, len(drawn) // 50)]
    row, column = few[len(few) // 2]
    found = np.argwhere(picture[row : row + rows, column : column + columns] == part[row, column])
    for row, column in few:
        found = found[picture[found[:, 0] + row, found[:, 1] + column] == part[row, column]]
    return [
        (int(left), int(top))
        for top, left in found
        if (picture[top : top + height, left : left + width] == part).all()
    ]


def word(text, size=15, colour=P.INK):
    """A text as it stands in a picture, without the paper around it."""
    font = ImageFont.load_default(size)
    page = Image.new("RGB", (round(font.getlength(text)) + 20, 40), P.PAPER)
    ImageDraw.Draw(page).text((10, 20), text, colour, font, anchor="lm")
    return page.crop(ImageChops.invert(page).getbbox())
