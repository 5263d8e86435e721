"""The two-layer GATv2 encoder (Eqs. 3-5, Table II), compiled: one pass over each graph.

The kernel knows the shape of an exploration graph: nine core nodes (the agent and its waypoints)
with fixed edges, and frontier nodes that each exchange one edge with their waypoint. The core
attends over fixed and frontier edges with a softmax; a frontier attends to itself and its waypoint,
so that its softmax is a sigmoid, called its gate. Padded frontiers are never visited. The backward
pass computes the forward pass again, which is cheaper than keeping it in memory.

Each graph is computed alone, and gradients are summed in chunks whose number depends on the batch
alone: results depend neither on the rest of the batch nor, bit for bit, on the number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch

from forestrl.functional import DISPLACEMENTS, FEATURES, WAYPOINT_EDGES, WAYPOINTS
from forestrl.kernels.compiling import compiled
from forestrl.policies.gatv2.vectors import exp, group_sums, load, spread, store, where_positive

_CORE = torch.cat((WAYPOINT_EDGES, torch.arange(WAYPOINTS).expand(2, -1)), -1)  # with self-loops
_SPAN = (DISPLACEMENTS[_CORE[0]] - DISPLACEMENTS[_CORE[1]]).double().norm(dim=-1).numpy()  # cells
_SOURCE, _TARGET = _CORE.numpy()
_CORE_EDGES = len(_SPAN)

# A network's parameters, and their gradients, are rows of one matrix with a column per channel of
# layer 1; lin_l.weight and lin_r.weight have a row per feature. The scalars of layer 2 are a second
# matrix of one column, in the rows of the same names.
_LEFT, _RIGHT = 0, FEATURES
_LEFT_BIAS, _RIGHT_BIAS, _EDGE, _ATT, _BIAS, _LEFT2, _RIGHT2, ROWS = range(16, 24)


class Graphs(NamedTuple):
    """A batch of exploration graphs; see :func:`forestrl.policies.gatv2.encoder.encode`."""

    x: np.ndarray
    waypoint: np.ndarray
    length: np.ndarray
    frontiers: np.ndarray


class _Net(NamedTuple):
    """The parameters of both layers as rows, see above; negative slopes; and 1 / l."""

    rows: np.ndarray
    scalars: np.ndarray
    slope: float
    slope2: float
    unit: float


class _Links(NamedTuple):
    """The edges into core nodes: the fixed ones first, then one from each frontier."""

    source: np.ndarray  # [E]
    target: np.ndarray  # [E]
    span: np.ndarray  # [E] length / l


class _Layer(NamedTuple):
    """What the passes over one graph hand on: N nodes, E edges into core nodes, C channels."""

    left: np.ndarray  # [N, C] lin_l(x_j), the values
    right: np.ndarray  # [N, C] lin_r(x_i)
    weight: np.ndarray  # [E, heads] scores e_ij (Eq. 3), then exp(e_ij - top_i)
    top: np.ndarray  # [9, heads] max_j e_ij; in the backward pass sum_j alpha_ij d alpha_ij
    scale: np.ndarray  # [9, heads] 1 / sum_j exp(e_ij - top_i)
    mixed: np.ndarray  # [9, C] sum_j alpha_ij lin_l(x_j)
    d_left: np.ndarray  # [N, C]
    d_right: np.ndarray  # [N, C]


class _Scratch(NamedTuple):
    """The memory one graph needs; used again for the next."""

    links: _Links
    first: _Layer
    second: _Layer
    gate: np.ndarray  # [N, heads] the attention of a frontier to its waypoint
    hidden: np.ndarray  # [N, C] layer 1 after ReLU; then its gradient before ReLU


@compiled
def _new_layer(nodes, edges, dtype, shape):
    """Allocates one layer's memory."""
    wide, heads = len(shape[0]), len(shape[1])
    return _Layer(
        np.empty((nodes, wide), dtype),
        np.empty((nodes, wide), dtype),
        np.empty((edges, heads), dtype),
        np.empty((WAYPOINTS, heads), dtype),
        np.empty((WAYPOINTS, heads), dtype),
        np.empty((WAYPOINTS, wide), dtype),
        np.empty((nodes, wide), dtype),
        np.empty((nodes, wide), dtype),
    )


@compiled
def _new_scratch(room, net, shapes):
    """Allocates memory for graphs of up to ``room`` frontiers and writes the fixed edges."""
    nodes, edges, dtype = WAYPOINTS + room, _CORE_EDGES + room, net.rows.dtype
    links = _Links(np.empty(edges, np.int64), np.empty(edges, np.int64), np.empty(edges, dtype))
    for e in range(_CORE_EDGES):
        links.source[e], links.target[e] = _SOURCE[e], _TARGET[e]
        links.span[e] = _SPAN[e] * net.unit
    return _Scratch(
        links,
        _new_layer(nodes, edges, dtype, shapes[0]),
        _new_layer(nodes, edges, dtype, shapes[1]),
        np.empty((nodes, len(shapes[0][1])), dtype),
        np.empty((nodes, net.rows.shape[1]), dtype),
    )


@compiled
def _link(waypoint, length, count, links):
    """Writes the frontier edges of a graph; tells whether every waypoint is one of 1 to 8."""
    valid = True
    for f in range(count):
        valid &= 0 < waypoint[f] < WAYPOINTS
        links.source[_CORE_EDGES + f] = WAYPOINTS + f
        links.target[_CORE_EDGES + f] = min(max(waypoint[f], 1), WAYPOINTS - 1)
        links.span[_CORE_EDGES + f] = length[f]
    return valid


@compiled
def _add(array, row, value, lanes):
    """``array[row] += value``."""
    store(array, row, load(array, row, lanes) + value)


@compiled
def _leaky(z, slope):
    """LeakyReLU."""
    return where_positive(z, z, slope * z)


@compiled
def _relu(y):
    """ReLU that keeps NaN, so that broken weights show in the logits."""
    return where_positive(-1 * y, 0, y)


@compiled
def _attend(links, edges, p, slope, a, shape):
    """Scores, softmax and weighted sums at the core nodes (Eqs. 3 to 5)."""
    lanes, heads, hidden = shape
    att, edge = load(p, _ATT, lanes), load(p, _EDGE, lanes)
    a.top[:], a.scale[:], a.mixed[:] = -np.inf, 0, 0
    for e in range(edges):
        i = links.target[e]
        z = load(a.left, links.source[e], lanes) + load(a.right, i, lanes) + links.span[e] * edge
        score, top = group_sums(att * _leaky(z, slope), heads), load(a.top, i, heads)
        store(a.weight, e, score)
        store(a.top, i, where_positive(score - top, score, top))
    for e in range(edges):
        i = links.target[e]
        weight = exp(load(a.weight, e, heads) - load(a.top, i, heads))
        store(a.weight, e, weight)
        _add(a.scale, i, weight, heads)
        value = load(a.left, links.source[e], lanes)
        _add(a.mixed, i, spread(weight, hidden) * value, lanes)
    for i in range(WAYPOINTS):
        scale = 1 / load(a.scale, i, heads)
        store(a.scale, i, scale)
        store(a.mixed, i, load(a.mixed, i, lanes) * spread(scale, hidden))


@compiled
def _attend_backward(links, edges, p, slope, a, shape, d_out, d_p):
    """Adds to ``d_left``, ``d_right`` and ``d_p`` what :func:`_attend` hands back."""
    lanes, heads, hidden = shape
    att, edge = load(p, _ATT, lanes), load(p, _EDGE, lanes)
    for i in range(WAYPOINTS):
        store(a.top, i, group_sums(load(d_out, i, lanes) * load(a.mixed, i, lanes), heads))
    for e in range(edges):
        i, j, span = links.target[e], links.source[e], links.span[e]
        value, d = load(a.left, j, lanes), load(d_out, i, lanes)
        alpha = load(a.weight, e, heads) * load(a.scale, i, heads)
        d_score = alpha * (group_sums(d * value, heads) - load(a.top, i, heads))
        d_score = spread(d_score, hidden)
        z = value + load(a.right, i, lanes) + span * edge
        d_z = where_positive(z, d_score, slope * d_score) * att
        _add(d_p, _ATT, d_score * _leaky(z, slope), lanes)
        _add(d_p, _EDGE, span * d_z, lanes)
        _add(a.d_left, j, spread(alpha, hidden) * d + d_z, lanes)
        _add(a.d_right, i, d_z, lanes)


@compiled
def _transform(x, nodes, p, a, lanes):
    """The linear maps of layer 1."""
    for i in range(nodes):
        left, right = load(p, _LEFT_BIAS, lanes), load(p, _RIGHT_BIAS, lanes)
        for k in range(FEATURES):
            if x[i, k] != 0:  # a node's class is one-hot
                left += x[i, k] * load(p, _LEFT + k, lanes)
                right += x[i, k] * load(p, _RIGHT + k, lanes)
        store(a.left, i, left)
        store(a.right, i, right)


@compiled
def _transform_backward(x, nodes, a, d_p, lanes):
    """Adds the gradients of the linear maps of layer 1."""
    for i in range(nodes):
        _add(d_p, _LEFT_BIAS, load(a.d_left, i, lanes), lanes)
        _add(d_p, _RIGHT_BIAS, load(a.d_right, i, lanes), lanes)
    for k in range(FEATURES):
        left, right = load(d_p, _LEFT + k, lanes), load(d_p, _RIGHT + k, lanes)
        for i in range(nodes):
            if x[i, k] != 0:
                left += x[i, k] * load(a.d_left, i, lanes)
                right += x[i, k] * load(a.d_right, i, lanes)
        store(d_p, _LEFT + k, left)
        store(d_p, _RIGHT + k, right)


@compiled
def _encode(x, nodes, net, s, shapes):
    """The forward pass of one graph; leaves the logits in ``s.second.mixed``, without bias."""
    (lanes, _, hidden), (one, _, _) = shapes
    p, a, edges, slope = net.rows, s.first, nodes - WAYPOINTS + _CORE_EDGES, net.slope
    _transform(x, nodes, p, a, lanes)
    _attend(s.links, edges, p, slope, a, shapes[0])
    att, edge, bias = load(p, _ATT, lanes), load(p, _EDGE, lanes), load(p, _BIAS, lanes)
    for i in range(WAYPOINTS):
        y = load(a.mixed, i, lanes) + bias
        store(s.hidden, i, _relu(y))
    for e in range(_CORE_EDGES, edges):  # a frontier attends to itself and to its waypoint
        i, w, reach = s.links.source[e], s.links.target[e], s.links.span[e] * edge
        left, right, other = load(a.left, i, lanes), load(a.right, i, lanes), load(a.left, w, lanes)
        own, back = _leaky(left + right, slope), _leaky(other + right + reach, slope)
        gate = 1 / (1 + exp(group_sums(att * (own - back), shapes[0][1])))
        store(s.gate, i, gate)
        y = left + spread(gate, hidden) * (other - left) + bias
        store(s.hidden, i, _relu(y))
    left2, right2 = load(p, _LEFT2, lanes), load(p, _RIGHT2, lanes)
    bias_left, bias_right = load(net.scalars, _LEFT_BIAS, one), load(net.scalars, _RIGHT_BIAS, one)
    for i in range(nodes):
        store(s.second.left, i, group_sums(load(s.hidden, i, lanes) * left2, one) + bias_left)
    for i in range(WAYPOINTS):
        store(s.second.right, i, group_sums(load(s.hidden, i, lanes) * right2, one) + bias_right)
    _attend(s.links, edges, net.scalars, net.slope2, s.second, shapes[1])


@compiled
def _encode_backward(x, nodes, net, s, shapes, d_logits, d, d2):
    """The backward pass of one graph, after :func:`_encode`; adds to ``d`` and ``d2``."""
    lanes, heads, hidden = shapes[0]
    p, a, edges, slope = net.rows, s.first, nodes - WAYPOINTS + _CORE_EDGES, net.slope
    s.second.d_left[:nodes], s.second.d_right[:WAYPOINTS] = 0, 0
    _attend_backward(s.links, edges, net.scalars, net.slope2, s.second, shapes[1], d_logits, d2)
    _readout_backward(nodes, net, s, shapes, d, d2)
    a.d_left[:WAYPOINTS], a.d_right[:WAYPOINTS] = 0, 0
    att, edge = load(p, _ATT, lanes), load(p, _EDGE, lanes)
    for e in range(_CORE_EDGES, edges):
        i, w, span = s.links.source[e], s.links.target[e], s.links.span[e]
        left, right, other = load(a.left, i, lanes), load(a.right, i, lanes), load(a.left, w, lanes)
        d_out, gate = load(s.hidden, i, lanes), load(s.gate, i, heads)
        d_gate = gate * (1 - gate) * group_sums(d_out * (other - left), heads)
        d_score = spread(d_gate, hidden)
        own, back = left + right, other + right + span * edge
        d_own = where_positive(own, d_score, slope * d_score) * att
        d_back = where_positive(back, d_score, slope * d_score) * att
        _add(d, _ATT, d_score * (_leaky(back, slope) - _leaky(own, slope)), lanes)
        _add(d, _EDGE, span * d_back, lanes)
        toward = spread(gate, hidden) * d_out
        store(a.d_left, i, d_out - toward - d_own)
        store(a.d_right, i, d_back - d_own)
        _add(a.d_left, w, toward + d_back, lanes)
    _attend_backward(s.links, edges, p, slope, a, shapes[0], s.hidden, d)
    _transform_backward(x, nodes, a, d, lanes)


@compiled
def _readout_backward(nodes, net, s, shapes, d, d2):
    """Through layer 2's linear maps and ReLU; leaves the gradient in ``s.hidden``."""
    lanes = shapes[0][0]
    left2, right2 = load(net.rows, _LEFT2, lanes), load(net.rows, _RIGHT2, lanes)
    for i in range(nodes):
        y, d_left = load(s.hidden, i, lanes), s.second.d_left[i, 0]
        d_y = d_left * left2
        _add(d, _LEFT2, d_left * y, lanes)
        d2[_LEFT_BIAS, 0] += d_left
        if i < WAYPOINTS:
            d_right = s.second.d_right[i, 0]
            d_y += d_right * right2
            _add(d, _RIGHT2, d_right * y, lanes)
            d2[_RIGHT_BIAS, 0] += d_right
        d_y = where_positive(y, d_y, 0)
        _add(d, _BIAS, d_y, lanes)
        store(s.hidden, i, d_y)


@compiled
def _chunk(chunk, chunks, graphs, net, shapes, logits, d, d2):
    """Writes one chunk's logits; or reads their gradients if ``d`` is not empty, adding to it."""
    lo, hi = (chunk * len(logits)) // chunks, ((chunk + 1) * len(logits)) // chunks
    room = 0
    for b in range(lo, hi):
        room = max(room, min(graphs.frontiers[b], graphs.waypoint.shape[1]))
    s = _new_scratch(room, net, shapes)
    valid = True
    for b in range(lo, hi):
        count = min(room, max(graphs.frontiers[b], 0))
        valid &= _link(graphs.waypoint[b], graphs.length[b], count, s.links)
        x, nodes = graphs.x[b], WAYPOINTS + count
        _encode(x, nodes, net, s, shapes)
        if len(d):
            d_logits = logits[b].reshape(-1, 1)
            _encode_backward(x, nodes, net, s, shapes, d_logits, d, d2)
            d2[_BIAS, 0] += logits[b].sum()
        else:
            for i in range(WAYPOINTS):
                logits[b, i] = s.second.mixed[i, 0] + net.scalars[_BIAS, 0]
    return valid


@compiled
def _pack(parameters, constants):
    """Writes the parameters, in :func:`forestrl.policies.gatv2.encoder.encode`'s order, as rows."""
    wide, dtype = len(parameters[0]), parameters[0].dtype
    p, p2 = np.empty((ROWS, wide), dtype), np.empty((ROWS, 1), dtype)
    p[_LEFT : _LEFT + FEATURES], p[_LEFT_BIAS] = parameters[0].T, parameters[1]
    p[_RIGHT : _RIGHT + FEATURES], p[_RIGHT_BIAS] = parameters[2].T, parameters[3]
    p[_EDGE], p[_ATT] = parameters[4][:, 0], parameters[5].reshape(-1)
    p[_BIAS], p[_LEFT2], p[_RIGHT2] = parameters[6], parameters[7][0], parameters[9][0]
    p2[_LEFT_BIAS], p2[_RIGHT_BIAS], p2[_EDGE] = parameters[8], parameters[10], parameters[11][0]
    p2[_ATT], p2[_BIAS] = parameters[12][0, 0], parameters[13]
    return _Net(p, p2, constants[0], constants[1], constants[2])


@compiled
def unpack_gradients(chunks, chunks2, gradients) -> None:
    """Sums the chunks' gradients in order and writes them in the order of ``encode``."""
    p, p2 = chunks[0], chunks2[0]
    for c in range(1, len(chunks)):
        p += chunks[c]
        p2 += chunks2[c]
    gradients[0][:], gradients[1][:] = p[_LEFT : _LEFT + FEATURES].T, p[_LEFT_BIAS]
    gradients[2][:], gradients[3][:] = p[_RIGHT : _RIGHT + FEATURES].T, p[_RIGHT_BIAS]
    gradients[4][:, 0], gradients[5].reshape(-1)[:] = p[_EDGE], p[_ATT]
    gradients[6][:], gradients[7][0], gradients[9][0] = p[_BIAS], p[_LEFT2], p[_RIGHT2]
    gradients[8][:], gradients[10][:] = p2[_LEFT_BIAS], p2[_RIGHT_BIAS]
    gradients[11][0], gradients[12][0, 0], gradients[13][:] = p2[_EDGE], p2[_ATT], p2[_BIAS]


@compiled(nogil=True)
def run_chunks(part, parts, graphs, parameters, constants, shapes, logits, d, d2) -> bool:
    """Runs one part of the chunks, :func:`_chunk`; tells whether the graphs are valid."""
    net, valid = _pack(parameters, constants), True
    for c in range(part * len(d) // parts, (part + 1) * len(d) // parts):
        valid &= _chunk(c, len(d), graphs, net, shapes, logits, d[c], d2[c])
    return valid
