"""What there is to know of a candidate."""

from __future__ import annotations

import numpy as np

from forestrl.explorer.unknown import blocks_of_unknown, mean_distance, pockets
from forestrl.kernels.compiling import compiled
from forestrl.planners.viewpoints.paths import Paths, only_here
from forestrl.planners.viewpoints.scores import (
    TERMS,
    Situation,
    in_window,
    terms,
    weighed,
    window_share,
)
from forestrl.planners.viewpoints.sight import Sight
from forestrl.planners.viewpoints.views import FREE, OCCUPIED, Views

FEATURES = (
    *TERMS,
    "score",
    "revealed",
    "revealed_per_length",
    "log_revealed",
    "revealed_share",
    "left_near",
    "left_around",
    "straight_on",
    "straight_on_mean",
    "straight_on_second",
    "to_unknown",
    "pocket",
    "of_need",
    "enough",
    "to_corner",
    "first_along_heading",
    "last_diagonal",
    "left_behind",
    "others_near",
    "known",
)
"""What is known of a candidate, in this order; :func:`put_features` says what each is."""


@compiled
def reveal(
    views: Views, sight: Sight, paths: Paths, goal: int, mark: np.ndarray, stamp: int
) -> tuple[np.ndarray, int]:
    """Finds all that could be seen on the way to a cell and at its end.

    Args:
        views: the map and what could be seen.
        sight: lines of sight.
        paths: from the robot.
        goal: the cell.
        mark: per cell, ``stamp`` where it is found; written.
        stamp: a number that is not in ``mark`` yet.

    Returns:
        the cells, and the first cell of the way.
    """
    found, n = np.empty(len(views.grid), np.int64), 0
    source = paths.order[0]
    cell, first = goal, goal
    while cell != source:
        if views.counts[cell] > 0:
            for k in range(len(sight.offsets)):
                lit = np.uint64(0)
                for w in range(sight.bits.shape[1]):
                    lit |= views.seen[cell, w] & sight.bits[k, w]
                there = cell + sight.offsets[k]
                if lit and mark[there] != stamp:
                    mark[there] = stamp
                    found[n] = there
                    n += 1
        first = cell
        cell = paths.before[cell]
    return found[:n], first


@compiled
def straight_on(views: Views, sight: Sight, cell: int, moves: int) -> tuple[float, float, float]:
    """Goes straight on from a cell in each direction, through the unknown too.

    Returns:
        cells that could be seen for the first time, by move: best direction, second, mean.
    """
    best, second, mean = 0.0, 0.0, 0.0
    for a in range(8):
        here, seen = cell, 0
        for _ in range(moves):
            there = here + sight.steps[a]
            if views.grid[there] == OCCUPIED:
                break
            if views.counts[there] > 0:
                seen += only_here(views, there, here, sight.shifts[a])
            here = there
        rate = seen / moves
        mean += rate / 8
        if rate > best:
            best, second = rate, best
        elif rate > second:
            second = rate
    return best, second, mean


@compiled
def put_features(
    views: Views,
    sight: Sight,
    stride: int,
    paths: Paths,
    here: Situation,
    weights: np.ndarray,
    share: float,
    cells: np.ndarray,
    out: np.ndarray,
) -> None:
    """Writes what is known of each candidate: :data:`FEATURES`, all of the order of one.

    Besides the terms of the linear score and that score itself: ``revealed``, the cells that could
    be seen on the way and at its end, as one set, also by move, as a logarithm, as a share of the
    two numbers that path gain adds, and as a share of what is still needed (``of_need``;
    ``enough`` if that is all), if the unknown holds as much free space as the known. What stays
    unknown around the candidate (``left_near``, ``left_around``) and around the robot
    (``left_behind``). What moving straight on from there would show by move: best and second
    direction, and the mean. How much nearer the unknown is from there than from here
    (``to_unknown``). The largest ``pocket`` of unknown cells that is touched. What could be seen
    from other candidates, the nearer the more (``others_near``).

    Args:
        views: the map and what could be seen.
        sight: lines of sight.
        stride: of the map.
        paths: from the robot.
        here: what is common to all cells.
        weights: of the linear score.
        share: the coverage to be reached.
        cells: numbers of the candidates.
        out: float64 ``[n, 34]``; written.
    """
    grid, unit, f = views.grid, here.unit, len(weights)
    mid, margin = int(np.rint(5 * unit)), here.margin
    straight = max(2, mid)
    size = pockets(grid, sight.steps)
    blocks = blocks_of_unknown(grid, stride, margin)
    from_here = mean_distance(blocks, here.row, here.col)
    unknown, free = float(here.sums[-1, -1]), 0
    for cell in range(len(grid)):
        free += grid[cell] == FREE
    known = (here.last_row + 1 - 2 * margin) * (here.last_col + 1 - 2 * margin) - unknown
    density = free / max(known, 1.0)
    need = max(1.0, share * (free + density * unknown) - free)
    behind = in_window(here.sums, here.row, here.col, here.far)
    mark = np.zeros(len(grid), np.int32)
    near_area, far_area = (2 * here.near + 1) ** 2, (2 * here.far + 1) ** 2
    ends = np.exp(weights[1])
    for i in range(len(cells)):
        cell, x = cells[i], out[i]
        r, c = cell // stride, cell % stride
        length = float(paths.lengths[cell])
        values = terms(here, stride, ends, cell, paths.gains[cell], views.counts[cell], length)
        for j in range(f):
            x[j] = values[j]
        x[f] = weighed(values, weights)
        revealed, first = reveal(views, sight, paths, cell, mark, i + 1)
        n = float(len(revealed))
        x[f + 1] = n / (50 * unit * unit)
        x[f + 2] = n / length / (10 * unit)
        x[f + 3] = np.log(max(n, 1.0))
        x[f + 4] = n / (paths.gains[cell] + views.counts[cell])
        in_near, in_far, by_robot, pocket = 0, 0, 0, 0
        for there in revealed:
            a, b = there // stride, there % stride
            away = max(abs(a - r), abs(b - c))
            in_near += away <= here.near
            in_far += away <= here.far
            by_robot += max(abs(a - here.row), abs(b - here.col)) <= here.far
            pocket = max(pocket, size[there])
        x[f + 5] = window_share(here.sums, r, c, here.near) - in_near / near_area
        x[f + 6] = window_share(here.sums, r, c, here.far) - in_far / far_area
        best, second, mean = straight_on(views, sight, cell, straight)
        x[f + 7] = best / (15 * unit)
        x[f + 8] = mean / (15 * unit)
        x[f + 9] = second / (15 * unit)
        x[f + 10] = (mean_distance(blocks, r, c) - from_here) / (10 * unit)
        x[f + 11] = np.log(1.0 + pocket) / 8
        x[f + 12] = min(1.0, n * density / need)
        x[f + 13] = 1.0 if n * density >= need else 0.0
        corner = max(min(r, here.last_row - r), min(c, here.last_col - c)) - margin
        x[f + 14] = corner / (10 * unit)
        x[f + 15] = 0.0
        if here.heading[2] > 0:
            dr, dc = first // stride - here.row, first % stride - here.col
            along = dr * here.heading[0] + dc * here.heading[1]
            x[f + 15] = along / (here.heading[2] * np.sqrt(float(dr * dr + dc * dc)))
        before = paths.before[cell]
        sideways = abs(r - before // stride) == abs(c - before % stride)
        x[f + 16] = 1.0 if sideways else 0.0
        x[f + 17] = (behind - by_robot) / far_area
        others = 0.0
        for other in cells:
            if other != cell and mark[other] != i + 1:
                away = max(abs(other // stride - r), abs(other % stride - c))
                others += views.counts[other] * np.exp(-away / (10 * unit))
        x[f + 18] = others / (100 * unit * unit)
        x[f + 19] = here.known
