"""The explorer's decision: from what could be seen to the cell to walk to."""

from __future__ import annotations

import numpy as np

from forestrl.explorer.compiled import Weights, residuals
from forestrl.explorer.features import put_features
from forestrl.kernels.compiling import compiled
from forestrl.planners.viewpoints.candidates import candidates, distance_apart
from forestrl.planners.viewpoints.guard import nearest_view, wavers
from forestrl.planners.viewpoints.paths import Paths
from forestrl.planners.viewpoints.scores import NOWHERE, Memory, linear, situation
from forestrl.planners.viewpoints.sight import Sight
from forestrl.planners.viewpoints.views import Views


@compiled
def compared(
    views: Views,
    sight: Sight,
    stride: int,
    paths: Paths,
    memory: Memory,
    weights: Weights,
    share: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Picks the candidates and scores them.

    Args:
        views: the map and what could be seen.
        sight: lines of sight.
        stride: of the map.
        paths: from the robot.
        memory: heading and last goal.
        weights: what the decision is made of.
        share: the coverage to be reached.

    Returns:
        their cell numbers, the highest linear score first, int64 ``[n]``; their scores, float64
        ``[n]``; their features, float64 ``[n, F]``.
    """
    here = situation(views, sight, stride, paths.order[0], memory)
    scores = linear(views, stride, paths, here, weights.linear)
    cells = candidates(paths, stride, scores, distance_apart(here.unit), weights.most)
    features = np.empty((len(cells), len(weights.mean)))
    if weights.most == 1 or len(cells) == 0:
        return cells, np.zeros(len(cells)), features
    put_features(views, sight, stride, paths, here, weights.linear, share, cells, features)
    added = residuals(weights, features, cells, stride, here.unit)
    return cells, features[:, len(weights.linear)] + added, features


@compiled
def decide(
    views: Views,
    sight: Sight,
    stride: int,
    paths: Paths,
    memory: Memory,
    weights: Weights,
    share: float,
) -> tuple[int, bool]:
    """Decides where to walk.

    The memory of the goal could make the robot waver between goals for ever. When nothing new was
    seen for longer than the longest path takes, the guard walks to the nearest cell from which
    something could be seen, until something is: no cycle lasts.

    Returns:
        the goal, ``NOWHERE`` if nothing can be seen from any cell within reach; whether the guard
        chose it.
    """
    if wavers(views, paths, memory):
        return nearest_view(views, paths), True
    cells, scores, _ = compared(views, sight, stride, paths, memory, weights, share)
    if len(cells) == 0:
        return NOWHERE, False
    return cells[np.argmax(scores)], False
