"""The explorer's network, compiled for one graph at a time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from forestrl.kernels.compiling import compiled

EDGES = 3
"""Features of an edge: see :func:`put_edge`."""
NEGATIVE_SLOPE = 0.2
"""Of the LeakyReLU in the attention."""


class Weights(NamedTuple):
    """All that the decision is made of; arrays are float32 unless said otherwise."""

    linear: np.ndarray
    """Of the linear score, float64 ``[14]``."""
    most: int
    """How many candidates are compared, ``M``; 1: the linear score alone decides."""
    mean: np.ndarray
    """Of the features, float64 ``[F]``."""
    scale: np.ndarray
    """Of the features, float64 ``[F]``."""
    skip: np.ndarray
    """``[F]``."""
    embed: np.ndarray
    """``[F, C]`` and its bias ``[C]``: the node encoder."""
    embed_bias: np.ndarray
    left: np.ndarray
    """``[layers, C, C]`` and bias ``[layers, C]``: of the sources."""
    left_bias: np.ndarray
    right: np.ndarray
    """``[layers, C, C]`` and bias ``[layers, C]``: of the targets."""
    right_bias: np.ndarray
    edge: np.ndarray
    """``[layers, 3, C]``."""
    attention: np.ndarray
    """``[layers, heads, C / heads]``."""
    out: np.ndarray
    """``[C]``."""


@compiled
def put_edge(row: int, col: int, reach: float, out: np.ndarray) -> None:
    """Writes the features of an edge between candidates so many rows and columns apart.

    They are the Chebyshev distance ``d`` in units of ``reach``, ``exp(-2 d)``, and whether ``d`` is
    less than 0.6.
    """
    distance = max(abs(row), abs(col)) / reach
    out[0] = distance
    out[1] = np.exp(-2 * distance)
    out[2] = 1.0 if distance < 0.6 else 0.0


@compiled
def _attend(
    x: np.ndarray, edges: np.ndarray, weights: Weights, layer: int, logits: np.ndarray
) -> np.ndarray:
    """One GATv2 layer over the complete graph, self-loops included (Eqs. 3 to 5)."""
    n, channels = x.shape
    heads = weights.attention.shape[1]
    per_head = channels // heads
    left = x @ weights.left[layer] + weights.left_bias[layer]
    right = x @ weights.right[layer] + weights.right_bias[layer]
    edge, attention = weights.edge[layer], weights.attention[layer]
    result = np.zeros((n, channels), np.float32)
    for i in range(n):
        for k in range(heads):
            first, top = k * per_head, np.float32(-np.inf)
            for j in range(n):
                logit = np.float32(0)
                for q in range(per_head):
                    c = first + q
                    value = left[j, c] + right[i, c]
                    for e in range(EDGES):
                        value += edges[i, j, e] * edge[e, c]
                    if value < 0:
                        value *= np.float32(NEGATIVE_SLOPE)
                    logit += value * attention[k, q]
                logits[j] = logit
                top = max(top, logit)
            total = np.float32(0)
            for j in range(n):
                logits[j] = np.exp(logits[j] - top)
                total += logits[j]
            for j in range(n):
                share = logits[j] / total
                for c in range(first, first + per_head):
                    result[i, c] += share * left[j, c]
    return result


@compiled
def residuals(
    weights: Weights, features: np.ndarray, cells: np.ndarray, stride: int, unit: float
) -> np.ndarray:
    """Gives what the network adds to the candidates' linear scores.

    Args:
        weights: of the network.
        features: of the candidates, float64 ``[n, F]``.
        cells: their numbers.
        stride: of the map.
        unit: of lengths, cells.

    Returns:
        float32 ``[n]``.
    """
    n = len(cells)
    nodes = ((features - weights.mean) / weights.scale).astype(np.float32)
    edges = np.empty((n, n, EDGES), np.float32)
    for i in range(n):
        for j in range(n):
            row = cells[i] // stride - cells[j] // stride
            put_edge(row, cells[i] % stride - cells[j] % stride, 10 * unit, edges[i, j])
    x = np.maximum(nodes @ weights.embed + weights.embed_bias, np.float32(0))
    logits = np.empty(n, np.float32)
    for layer in range(len(weights.left)):
        x = np.maximum(x + _attend(x, edges, weights, layer, logits), np.float32(0))
    return nodes @ weights.skip + x @ weights.out
