"""The attention in plain loops is the same attention."""

import numpy as np
import pytest

from forestrl.benchmark.attention import plain_attend, random_inputs
from forestrl.policies.gatv2.passes import _ATT, _EDGE, _attend


@pytest.mark.parametrize(("edges", "heads", "hidden"), [(144, 4, 16), (49, 1, 1), (60, 3, 5)])
def test_plain_loops_equal_vectors(edges, heads, hidden):
    vectors, loops = (random_inputs(edges, heads=heads, hidden=hidden) for _ in range(2))
    _attend(*vectors)
    plain_attend(*loops)
    for name in ("weight", "top", "scale", "mixed"):
        ours, theirs = (getattr(each[4], name) for each in (loops, vectors))
        np.testing.assert_allclose(ours, theirs, rtol=1e-4, atol=1e-5, err_msg=name)


def test_plain_loops_equal_equations_3_to_5():
    """Scores, softmax and weighted sums written out, one core node after the other."""
    inputs = random_inputs(200)
    plain_attend(*inputs)
    links, _, parameters, slope, layer, _ = inputs
    att, edge = parameters[_ATT], parameters[_EDGE]
    for node in range(9):
        chosen = links.target == node
        values = layer.left[links.source[chosen]]
        z = values + layer.right[node] + links.span[chosen, None] * edge
        scores = (att * np.where(z > 0, z, slope * z)).reshape(-1, 4, 16).sum(-1)
        alpha = np.exp(scores) / np.exp(scores).sum(0)
        mixed = (alpha[..., None] * values.reshape(-1, 4, 16)).sum(0).reshape(-1)
        np.testing.assert_allclose(layer.mixed[node], mixed, rtol=1e-3, atol=1e-4)
