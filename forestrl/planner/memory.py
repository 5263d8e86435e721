"""What a policy remembers, when the robot's map changes under it, and as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from tensordict import TensorDict, TensorDictBase

from forestrl.explorer.policy import GOAL, HEADING, IDLE
from forestrl.planners.viewpoints.path_gain import COUNTS, GRID, SEEN
from forestrl.planners.viewpoints.scores import NOWHERE
from forestrl.planners.viewpoints.sight import sight
from forestrl.planners.viewpoints.views import Views, blank, spend, update

_VIEWS = (GRID, SEEN, COUNTS)


def carried_over(state: TensorDictBase) -> TensorDictBase:
    """Keeps of a memory what does not depend on where the map begins and ends."""
    kept = state.select(HEADING, IDLE, strict=False)
    if HEADING in state.keys(True):
        kept[GOAL] = torch.full((1,), NOWHERE)
    return kept


def keep_views(
    state: TensorDictBase, cells: np.ndarray, visited: np.ndarray, lidar_range: float
) -> None:
    """Brings what could be seen to the map, where the policy would forget where the robot was.

    A policy that keeps views looks at a map anew that does not follow from the one before, as where
    a cell is no longer occupied; then it would take it that from the cells where the robot has been
    something more could be seen.

    Args:
        state: the policy's memory; written.
        cells: the map, uint8 ``[H, W]``.
        visited: where the robot has been, (row, col), int64 ``[n, 2]``.
        lidar_range: cells.
    """
    lines = sight(lidar_range, cells.shape[1])
    if GRID in state.keys(True):
        grid, seen, counts = (state[key].contiguous() for key in _VIEWS)
        views = Views(grid.numpy(), seen.numpy().view(np.uint64), counts.numpy())
    else:
        views = blank(*cells.shape, lines)
        grid, counts = torch.from_numpy(views.grid), torch.from_numpy(views.counts)
        seen = torch.from_numpy(views.seen.view(np.int64))
    fresh = GRID not in state.keys(True)
    if not update(views, lines, cells) or fresh:
        stride = cells.shape[1] + 2 * lines.margin
        for row, col in visited + lines.margin:
            spend(views, row * stride + col)
    state[GRID], state[SEEN], state[COUNTS] = grid, seen, counts


def as_text(state: TensorDictBase) -> dict[str, Any]:
    """Gives a memory as JSON can hold it, without what follows from the map."""
    if "planner" not in state.keys():
        return {}
    kept = state.select("planner").exclude(*_VIEWS)
    return {
        key[-1]: {"dtype": str(value.dtype).removeprefix("torch."), "values": value.tolist()}
        for key, value in kept.items(True, True)
    }


def from_text(text: Mapping[str, Any]) -> TensorDictBase:
    """Takes up what :func:`as_text` gave."""
    state = TensorDict()
    for name, entry in text.items():
        value = torch.tensor(entry["values"], dtype=getattr(torch, entry["dtype"]))
        state["planner", name] = value
    return state
