"""The inner loop of the compiled network in plain loops, to see what its vectors gain."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from forestrl.functional import WAYPOINTS
from forestrl.policies.gatv2.passes import _ATT, _EDGE, ROWS, _Layer, _Links
from forestrl.policies.gatv2.vectors import static


def random_inputs(edges: int, *, nodes: int = 104, heads: int = 4, hidden: int = 16) -> Any:
    """Makes arguments for both versions; by default of a mean graph and Table II."""
    generator, wide = np.random.default_rng(0), heads * hidden

    def normal(*shape: int) -> np.ndarray:
        return generator.normal(size=shape).astype(np.float32)

    source, target = generator.integers(0, (nodes, WAYPOINTS), (edges, 2)).T.copy()
    left, right, d_left, d_right = normal(4, nodes, wide)
    top, scale = normal(2, WAYPOINTS, heads)
    weight, mixed = normal(edges, heads), normal(WAYPOINTS, wide)
    layer = _Layer(left, right, weight, top, scale, mixed, d_left, d_right)
    links, shape = _Links(source, target, normal(edges)), static(wide, heads, hidden)
    return links, edges, normal(ROWS, wide), np.float32(0.2), layer, shape


@njit(cache=True, fastmath=True)
def plain_attend(links, edges, p, slope, a, shape) -> None:  # noqa: ANN001
    """The twin of :func:`forestrl.policies.gatv2.passes._attend`, channel by channel."""
    heads, hidden = len(shape[1]), len(shape[2])
    att, edge = p[_ATT].reshape(heads, hidden), p[_EDGE].reshape(heads, hidden)
    left, right = a.left.reshape(-1, heads, hidden), a.right.reshape(-1, heads, hidden)
    mixed = a.mixed.reshape(-1, heads, hidden)
    a.top[:], a.scale[:], a.mixed[:] = -1e30, 0, 0
    for e in range(edges):
        i, j, span = links.target[e], links.source[e], links.span[e]
        for h in range(heads):
            score = 0 * span
            for c in range(hidden):
                z = left[j, h, c] + right[i, h, c] + span * edge[h, c]
                score += att[h, c] * (z if z > 0 else slope * z)
            a.weight[e, h] = score
            a.top[i, h] = max(a.top[i, h], score)
    for e in range(edges):
        i, j = links.target[e], links.source[e]
        for h in range(heads):
            weight = math.exp(a.weight[e, h] - a.top[i, h])
            a.weight[e, h] = weight
            a.scale[i, h] += weight
            for c in range(hidden):
                mixed[i, h, c] += weight * left[j, h, c]
    for i in range(WAYPOINTS):
        for h in range(heads):
            a.scale[i, h] = 1 / a.scale[i, h]
            for c in range(hidden):
                mixed[i, h, c] *= a.scale[i, h]
