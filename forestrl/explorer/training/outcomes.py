"""What would have become of an episode, had another viewpoint been chosen: paired outcomes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from forestrl.explorer.compiled import Weights
from forestrl.explorer.deciding import compared
from forestrl.explorer.training.episodes import Episode, advance, begin, copied, coverage
from forestrl.kernels.batches import over_batch
from forestrl.kernels.compiling import compiled
from forestrl.planners.viewpoints.paths import paths_from
from forestrl.planners.viewpoints.scores import NOWHERE
from forestrl.planners.viewpoints.sight import Sight, sight

NOT_TRIED = -1.0
"""In place of the outcome of a candidate that was not chosen."""


class Outcomes(NamedTuple):
    """States of episodes with what became of some of their candidates; ``n`` states."""

    features: np.ndarray
    """Of the candidates, float32 ``[n, M, F]``; 0 where there is none."""
    places: np.ndarray
    """Row and column of the candidates, cells, float32 ``[n, M, 2]``."""
    there: np.ndarray
    """Which candidates there are, bool ``[n, M]``."""
    scores: np.ndarray
    """Those of the policy that explored, float32 ``[n, M]``."""
    steps: np.ndarray
    """Of the whole episode, had it gone there first, float32 ``[n, M]``; ``NOT_TRIED``."""
    arena: np.ndarray
    """Which arena the state is of, int64 ``[n]``."""


@compiled
def _finish(
    episode: Episode,
    lines: Sight,
    stride: int,
    weights: Weights,
    levels: np.ndarray,
    option: int,
    limit: int,
) -> float:
    """Goes to a cell, on with the policy to the last level; returns the mean steps to the levels.

    ``levels[0]`` is the coverage to be reached; the mean over several levels is less chaotic.
    """
    total, reached, last = 0.0, 0, levels.max()
    passed = np.zeros(len(levels), np.bool_)
    going = True
    while True:
        for i in range(len(levels)):
            if not passed[i] and coverage(episode) >= levels[i]:
                passed[i] = True
                total += episode.at[2]
                reached += 1
        if reached == len(levels) or coverage(episode) >= last or episode.at[2] >= limit:
            break
        if episode.at[0] == option or episode.views.counts[option] == 0:
            going = False
        to = option if going else NOWHERE
        if advance(episode, lines, stride, weights, levels[0], to) == NOWHERE:
            break
    return (total + (len(levels) - reached) * limit) / len(levels)


@compiled
def _options(scores: np.ndarray, most: int) -> np.ndarray:
    """Draws candidates without replacement: the best, and others as a softmax would."""
    keys = scores - np.log(-np.log(np.random.random(len(scores))))
    keys[np.argmax(scores)] = np.inf
    return np.argsort(-keys)[:most]


@over_batch
def _gather(
    first: int,
    last: int,
    trees: np.ndarray,
    starts: np.ndarray,
    seeds: np.ndarray,
    lines: Sight,
    weights: Weights,
    playing: Weights,
    levels: np.ndarray,
    rate: float,
    options: int,
    limit: int,
    features: np.ndarray,
    places: np.ndarray,
    scores: np.ndarray,
    steps: np.ndarray,
    count: np.ndarray,
    candidates: np.ndarray,
) -> None:
    stride = trees.shape[2] + 2 * lines.margin
    room = features.shape[1]
    for a in range(first, last):
        np.random.seed(seeds[a])
        episode = begin(trees[a], starts[a, 0], starts[a, 1], lines)
        n = 0
        while coverage(episode) < levels[0] and episode.at[2] < limit and n < room:
            if np.random.random() < rate:
                views, memory = episode.views, episode.memory
                paths = paths_from(views, lines, episode.at[0])
                cells, found, what = compared(
                    views, lines, stride, paths, memory, weights, levels[0]
                )
                if len(cells) > 1:
                    candidates[a, n] = len(cells)
                    for j in range(len(cells)):
                        features[a, n, j] = what[j]
                        places[a, n, j, 0] = cells[j] // stride
                        places[a, n, j, 1] = cells[j] % stride
                        scores[a, n, j] = found[j]
                    for j in _options(found, options):
                        steps[a, n, j] = _finish(
                            copied(episode), lines, stride, playing, levels, cells[j], limit
                        )
                    n += 1
            if advance(episode, lines, stride, playing, levels[0], NOWHERE) == NOWHERE:
                break
        count[a] = n


def adds_anything(weights: Weights) -> bool:
    """Tells whether the network adds anything to the linear scores; without, they decide alone."""
    return bool(weights.skip.any() or weights.out.any())


def gather(
    trees: np.ndarray,
    starts: np.ndarray,
    seeds: np.ndarray,
    *,
    lidar_range: float,
    weights: Weights,
    coverage_goal: float,
    rate: float,
    options: int,
    room: int = 24,
    limit: int = 1500,
) -> Outcomes:
    """Explores arenas, and at some states tries several of the candidates to the end.

    The tries of a state differ in the cell that is walked to first and in nothing else.

    Args:
        trees: bool ``[n, H, W]``.
        starts: cells, (row, col), int64 ``[n, 2]``.
        seeds: of the draws in each arena, int64 ``[n]``.
        lidar_range: ``l``, cells.
        weights: of the policy.
        coverage_goal: the coverage that ends an episode.
        rate: share of the steps at which candidates are tried.
        options: candidates tried at such a step, the policy's own choice among them.
        room: states of one arena at most.
        limit: steps of an episode at most.
    """
    n, most = len(trees), weights.most
    features = np.zeros((n, room, most, len(weights.mean)), np.float32)
    places, scores = np.zeros((n, room, most, 2), np.float32), np.zeros((n, room, most), np.float32)
    steps = np.full((n, room, most), NOT_TRIED, np.float32)
    count, candidates = np.zeros(n, np.int64), np.zeros((n, room), np.int64)
    levels = np.array([coverage_goal, coverage_goal - 0.005, coverage_goal + 0.005], np.float32)
    _gather(
        trees,
        starts,
        seeds,
        sight(lidar_range, trees.shape[2]),
        weights,
        weights if adds_anything(weights) else weights._replace(most=1),
        levels[levels < 1],
        rate,
        options,
        limit,
        features,
        places,
        scores,
        steps,
        count,
        candidates,
    )
    used = np.arange(room) < count[:, None]
    there = np.arange(most) < candidates[..., None]
    arena = np.broadcast_to(np.arange(n)[:, None], used.shape)
    return Outcomes(*(x[used] for x in (features, places, there, scores, steps, arena)))
