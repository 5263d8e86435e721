"""The fused encoder equals PyTorch Geometric's layers, and both equal Eqs. 3 to 5 written out."""

from __future__ import annotations

import copy

import numpy as np
import pytest
import torch
from numba import njit

from forestrl import functional as F
from forestrl.policies.gatv2 import Critic, GATv2Encoder, vectors

ROOM = 24
BATCHES = [(), (3,), (2, 3)]
DOUBLE = torch.float64
SLOW = pytest.mark.slow  # every size is compiled anew


def graphs(batch=(), low=0, high=ROOM, room=ROOM, dtype=DOUBLE, seed=0):
    """Random graphs in padded form with ``low`` to ``high`` frontiers."""
    generator = torch.Generator().manual_seed(seed)
    frontiers = torch.randint(low, high + 1, (*batch, 1), generator=generator)
    listed = torch.arange(room) < frontiers
    waypoint = torch.randint(1, 9, (*batch, room), generator=generator) * listed
    length = torch.rand(*batch, room, generator=generator) * listed
    kind = torch.tensor([0] + [1] * 5 + [2] * 3 + [3] * room)
    kind = torch.nn.functional.one_hot(kind, 4).expand(*batch, -1, -1)
    x = torch.cat((kind, torch.rand(*batch, 9 + room, 4, generator=generator)), -1)
    x[..., 9:, :] *= listed.unsqueeze(-1)
    return F.Graph(x.to(dtype), waypoint, length.to(dtype), frontiers)


def encoders(dtype=DOUBLE, seed=1, **kwargs):
    """A fused encoder and PyTorch Geometric's with the same random weights, biases included."""
    fused = GATv2Encoder(kernel="fused", **kwargs).to(dtype)
    generator = torch.Generator().manual_seed(seed)
    for parameter in fused.parameters():
        parameter.data = torch.randn(parameter.shape, generator=generator).to(dtype) / 2
    pyg = GATv2Encoder(kernel="pyg", **kwargs).to(dtype)
    pyg.load_state_dict(fused.state_dict())
    return fused, pyg


def gradients(encoder, graph):
    """The logits, and the parameters' gradients of a sum with uneven weights."""
    logits = encoder(*graph)
    weights = torch.linspace(-1, 2, logits.numel(), dtype=logits.dtype).view_as(logits)
    names, parameters = zip(*encoder.named_parameters(), strict=True)
    return logits, dict(
        zip(names, torch.autograd.grad((logits * weights).sum(), parameters), strict=True)
    )


def assert_equal_networks(fused, pyg, graph):
    """Logits and gradients agree, to 1e-6 of each tensor's largest entry."""
    ours, our_gradients = gradients(fused, graph)
    theirs, their_gradients = gradients(pyg, graph)
    torch.testing.assert_close(ours, theirs, rtol=1e-6, atol=1e-7)
    for name, theirs in their_gradients.items():
        atol = 1e-6 * max(theirs.abs().max().item(), 1e-3)
        torch.testing.assert_close(our_gradients[name], theirs, rtol=1e-6, atol=atol, msg=name)


@pytest.mark.parametrize("batch", BATCHES)
def test_fused_equals_pyg(batch):
    assert_equal_networks(*encoders(), graphs(batch))


@pytest.mark.parametrize("frontiers", [0, 1, ROOM])
def test_fused_equals_pyg_without_and_with_all_frontiers(frontiers):
    assert_equal_networks(*encoders(), graphs((3,), frontiers, frontiers))


def test_frontiers_beyond_the_capacity_are_ignored():
    graph = graphs((3,), ROOM, ROOM)
    more = graph._replace(frontiers=graph.frontiers + 100)
    for encoder in encoders():
        assert torch.equal(encoder(*more), encoder(*graph))


@pytest.mark.parametrize(
    ("hidden", "heads"), [(3, 2), pytest.param(1, 1, marks=SLOW), pytest.param(8, 3, marks=SLOW)]
)
def test_other_sizes(hidden, heads):
    assert_equal_networks(*encoders(hidden=hidden, heads=heads), graphs((3,)))


def test_other_lidar_range():
    assert_equal_networks(*encoders(lidar_range=8.0), graphs((3,)))


def test_without_edge_lengths_the_attention_reads_none():
    graph = graphs((3,))
    assert_equal_networks(*encoders(edge_lengths=False), graph)
    for blind, seeing in zip(encoders(edge_lengths=False), encoders(), strict=True):
        farther = graph._replace(length=3 * graph.length)
        assert torch.equal(blind(*farther), blind(*graph))
        assert not torch.equal(seeing(*farther), seeing(*graph))
        with torch.no_grad():  # lengths enter by these weights alone
            for conv in (seeing.conv1, seeing.conv2):
                conv.lin_edge.weight.zero_()
        torch.testing.assert_close(blind(*graph), seeing(*graph))


def test_graphs_without_room_for_frontiers():
    assert_equal_networks(*encoders(), graphs((3,), 0, 0, room=0))


def test_float32_is_as_close_as_float32_can_be():
    fused, _ = encoders(torch.float32)
    exact = copy.deepcopy(fused).double()
    ours, our_gradients = gradients(fused, graphs((3,), dtype=torch.float32))
    theirs, their_gradients = gradients(exact, graphs((3,)))
    torch.testing.assert_close(ours.double(), theirs, rtol=1e-5, atol=1e-5)
    for name, theirs in their_gradients.items():
        torch.testing.assert_close(our_gradients[name].double(), theirs, rtol=1e-4, atol=1e-4)


def test_equations_3_to_5_written_out():
    """One graph, its edges listed one by one, and no library but torch."""
    encoder, pyg = encoders()
    graph = graphs(low=7, high=7)
    cells = F.DISPLACEMENTS.tolist()
    into = {i: {i: 0.0} for i in range(9 + 7)}  # target: {source: length / l}
    for i, (row, col) in enumerate(cells):
        for j, (other_row, other_col) in enumerate(cells):
            if max(abs(row - other_row), abs(col - other_col)) == 1:
                into[i][j] = ((row - other_row) ** 2 + (col - other_col) ** 2) ** 0.5 / 5.0
    for f in range(7):
        w, length = graph.waypoint[f].item(), graph.length[f].item()
        into[9 + f][w] = into[w][9 + f] = length

    def layer(conv, x):
        left, right = conv.lin_l(x), conv.lin_r(x)  # plain linear maps
        heads, channels = conv.att.shape[1:]
        rows = []
        for i, edges in into.items():
            values = left[list(edges)]
            lengths = torch.tensor(list(edges.values()), dtype=x.dtype).unsqueeze(-1)
            z = values + right[i] + lengths * conv.lin_edge.weight.squeeze(-1)
            z = torch.where(z > 0, z, 0.2 * z).view(-1, heads, channels)
            e = (z * conv.att).sum(-1)  # Eq. 3
            alpha = e.exp() / e.exp().sum(0)  # Eq. 4
            mixed = (alpha.unsqueeze(-1) * values.view(-1, heads, channels)).sum(0)
            rows.append(mixed.flatten() + conv.bias)  # Eq. 5
        return torch.stack(rows)

    expected = layer(encoder.conv2, layer(encoder.conv1, graph.x[:16]).relu())[:9, 0]
    torch.testing.assert_close(encoder(*graph), expected, rtol=1e-6, atol=1e-7)
    torch.testing.assert_close(pyg(*graph), expected, rtol=1e-6, atol=1e-7)


def test_table_2_shapes():
    encoder = GATv2Encoder()
    assert encoder.conv1.lin_l.weight.shape == (16 * 4, 8)
    assert encoder.conv1.att.shape == (1, 4, 16)
    assert encoder.conv2.lin_l.weight.shape == (1, 64)
    assert encoder.conv2.att.shape == (1, 1, 1)


def test_padding_never_changes_the_logits():
    graph = graphs((3,), high=ROOM - 1)
    padding = torch.arange(ROOM) >= graph.frontiers
    x = graph.x.clone()
    x[:, 9:][padding] = torch.nan
    spoiled = F.Graph(
        x,
        graph.waypoint.masked_fill(padding, 10**6),
        graph.length.masked_fill(padding, torch.nan),
        graph.frontiers,
    )
    fused, _ = encoders()
    ours, our_gradients = gradients(fused, spoiled)
    clean, clean_gradients = gradients(fused, graph)
    assert torch.equal(ours, clean)
    for name, gradient in clean_gradients.items():
        assert torch.equal(our_gradients[name], gradient)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_graph_alone_equals_the_same_graph_in_a_batch(dtype):
    graph = graphs((19,), dtype=dtype)
    fused, _ = encoders(dtype)
    together = fused(*graph)
    alone = torch.stack([fused(*(leaf[i] for leaf in graph)) for i in range(19)])
    assert torch.equal(together, alone)
    with torch.no_grad():
        assert torch.equal(together, fused(*graph))


def test_result_does_not_depend_on_the_number_of_threads():
    graph = graphs((150,), dtype=torch.float32)
    fused, _ = encoders(torch.float32)
    before = torch.get_num_threads()
    results = []
    try:
        for threads in (1, 2, 3):
            torch.set_num_threads(threads)
            results.append(gradients(fused, graph))
    finally:
        torch.set_num_threads(before)
    (logits, first), *others = results
    for other_logits, other in others:
        assert torch.equal(logits, other_logits)
        assert all(torch.equal(first[name], other[name]) for name in first)


def test_strided_inputs_and_weights():
    """Views of larger tensors, and gradients that autograd expands, are as good as copies."""
    graph = graphs((4,))
    fused, _ = encoders()
    views = F.Graph(*(torch.stack((leaf, leaf), 1)[:, 0] for leaf in graph))
    assert not views.x.is_contiguous()
    assert torch.equal(fused(*views), fused(*graph))
    weight = fused.conv1.lin_l.weight
    (direct,) = torch.autograd.grad((fused(*graph) * 1.0).sum(), weight)
    (expanded,) = torch.autograd.grad(fused(*views).sum(), weight)
    assert torch.equal(direct, expanded)


def test_an_empty_batch():
    fused, _ = encoders()
    logits, all_gradients = gradients(fused, graphs((0,)))
    assert logits.shape == (0, 9)
    assert not any(gradient.any() for gradient in all_gradients.values())


def test_large_scores_stay_finite():
    fused, pyg = encoders()
    for encoder in (fused, pyg):
        for parameter in encoder.parameters():
            parameter.data *= 10
    assert_equal_networks(fused, pyg, graphs((3,)))
    logits, all_gradients = gradients(fused.float(), graphs((3,), dtype=torch.float32))
    assert logits.isfinite().all()
    assert all(gradient.isfinite().all() for gradient in all_gradients.values())


def test_nan_weights_show():
    fused, _ = encoders(torch.float32)
    fused.conv1.att.data[:] = torch.nan
    assert fused(*graphs(low=1, dtype=torch.float32)).isnan().all()


@pytest.mark.parametrize("field", ["x", "length"])
def test_inputs_have_no_gradient(field):
    fused, pyg = encoders()
    graph = graphs()
    leaf = getattr(graph, field).requires_grad_()
    with pytest.raises(ValueError, match="no gradient for x"):
        fused(*graph)
    (gradient,) = torch.autograd.grad(pyg(*graph).sum(), leaf, allow_unused=True)
    assert gradient is None or gradient.isfinite().all()


def test_second_derivatives_are_refused():
    fused, _ = encoders()
    weight = fused.conv1.lin_l.weight
    (gradient,) = torch.autograd.grad(fused(*graphs()).square().sum(), weight, create_graph=True)
    with pytest.raises(RuntimeError, match="once_differentiable"):
        gradient.sum().backward()


def test_wrong_input_is_refused():
    fused, _ = encoders()
    graph = graphs(low=3)
    with pytest.raises(ValueError, match="must be in 1 to 8"):
        fused(*graph._replace(waypoint=graph.waypoint + 8))
    with pytest.raises(ValueError, match=r"x must be \[\*B, 9 \+ 24, 8\]"):
        fused(*graph._replace(x=graph.x[:-1]))
    with pytest.raises(TypeError, match="float32"):
        fused(*graph._replace(x=graph.x.float()))


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"kernel": "cuda"}, "kernel=cuda is not allowed: it must be fused or pyg"),
        ({"hidden": 0}, "hidden=0 is not allowed: .* from 1 to 1024"),
        ({"heads": -1}, "heads=-1 is not allowed: .* from 1 to 64"),
    ],
)
def test_wrong_settings_are_refused(kwargs, message):
    with pytest.raises(ValueError, match=message):
        GATv2Encoder(**kwargs)


@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize("readout", ["mean", "concat"])
def test_critic_aggregates_the_nine_outputs(batch, readout):
    encoder, _ = encoders()
    critic = Critic(encoder, readout).to(DOUBLE)
    outputs = encoder(*graphs(batch))
    outputs = outputs.mean(-1, keepdim=True) if readout == "mean" else outputs
    expected = outputs @ critic.linear.weight.T + critic.linear.bias
    value = critic(*graphs(batch))
    assert value.shape == (*batch, 1)
    torch.testing.assert_close(value, expected)


def test_critic_names_the_readouts():
    with pytest.raises(ValueError, match="readout=max is not allowed: it must be mean or concat"):
        Critic(GATv2Encoder(), readout="max")


@njit
def _exponentials(values, lanes):
    for i in range(len(values)):
        vectors.store(values, i, vectors.exp(vectors.load(values, i, lanes)))


@pytest.mark.parametrize(("dtype", "error"), [(np.float32, 5e-7), (np.float64, 1e-15)])
def test_exp(dtype, error):
    x = np.linspace(-87, 88, 8 * 5000).astype(dtype).reshape(-1, 8)
    expected = np.exp(x.astype(np.float64))
    _exponentials(x, vectors.static(8)[0])
    np.testing.assert_allclose(x, expected, rtol=error)


def test_exp_beyond_its_range():
    x = np.array([[-np.inf, -200.0, np.nan, 200.0]], np.float32)
    _exponentials(x, vectors.static(4)[0])
    assert (x[0, :2] < 2e-38).all()
    assert np.isnan(x[0, 2])
    assert 1e38 < x[0, 3] < np.inf


def test_a_network_too_wide_to_compile_is_computed_by_pyg_and_says_so_once(caplog):
    torch.manual_seed(0)
    wide, other = (GATv2Encoder(hidden=129, heads=4) for _ in range(2))
    assert wide.kernel == other.kernel == "pyg"
    assert wide(*graphs((3,), dtype=torch.float32)).shape == (3, 9)
    (message,) = caplog.messages
    assert message.startswith("heads x hidden = 516 is more than is compiled, 512")
    assert GATv2Encoder(hidden=128, heads=4).kernel == "fused"
