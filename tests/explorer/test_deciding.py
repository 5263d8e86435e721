"""The explorer's candidates, what is known of them, and its goal, against slow loops."""

import numpy as np
import pytest
import torch
from hypothesis import given as each
from tensordict import TensorDict

from forestrl import keys as K
from forestrl.explorer import ViewpointGATv2
from forestrl.explorer.deciding import compared
from forestrl.explorer.features import FEATURES
from forestrl.functional import sight_lines
from forestrl.planners.viewpoints.path_gain import look
from forestrl.planners.viewpoints.paths import paths_from
from forestrl.planners.viewpoints.scores import Memory
from forestrl.planners.viewpoints.sight import sight
from forestrl.planners.viewpoints.views import blank
from tests.explorer import slow
from tests.planners import viewpoints as planner
from tests.planners.test_viewpoints import RANGES, SEEDS, known

SHARE = 0.98


def explorer(seed, lidar_range, candidates=6):
    torch.manual_seed(seed)
    network = ViewpointGATv2(lidar_range, SHARE, candidates, hidden=3, heads=2)
    network.linear.copy_(torch.from_numpy(np.random.default_rng(seed).normal(size=14)))
    for last in (network.out, network.skip):
        torch.nn.init.normal_(last.weight)
    return network


@each(SEEDS, RANGES)
def test_candidates_and_features_equal_their_loops(seed, lidar_range):
    cells, position = known(seed, lidar_range)
    network = explorer(seed, lidar_range)
    weights, start = network.linear.tolist(), tuple(position.tolist())
    world = planner.Map(cells.tolist(), sight_lines(lidar_range))
    paths = planner.Paths(world, start)
    rng = np.random.default_rng(seed)
    heading = rng.normal(size=2) * (seed % 3 > 0)
    last = (int(rng.integers(world.rows)), int(rng.integers(world.cols))) if seed % 5 else None

    lines = sight(lidar_range, world.cols)
    stride = world.cols + 2 * lines.margin

    def number(cell):
        return (cell[0] + lines.margin) * stride + cell[1] + lines.margin

    views = blank(world.rows, world.cols, lines)
    source = look(views, lines, cells.numpy(), *start)
    memory = Memory(
        heading.copy(), np.array([-1 if last is None else number(last)]), np.zeros(2, np.int64)
    )
    found, _, values = compared(
        views, lines, stride, paths_from(views, lines, source), memory, network.pack(), SHARE
    )

    ends = np.exp(weights[1])
    scores = {
        cell: planner.linear_score(
            planner.terms(world, paths, cell, lidar_range, heading, last, ends), weights
        )
        for cell in paths.goals()
    }
    least = max(1, round(3 * lidar_range / 5))
    wanted = slow.candidates(scores, least, network.candidates)
    numbers = [number(cell) for cell in wanted]
    if list(found) != numbers:  # only where two scores are as good as equal
        ordered = [scores[cell] for cell in wanted]
        gaps = np.abs(np.subtract.outer(list(scores.values()), ordered))
        assert ((gaps > 0) & (gaps < 1e-9)).any()
        return
    expected = slow.features(world, paths, wanted, weights, lidar_range, heading, last, SHARE)
    np.testing.assert_allclose(
        values, np.array(expected).reshape(-1, len(FEATURES)), rtol=1e-6, atol=1e-6
    )


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("candidates", [2, 10])
def test_the_compiled_network_equals_the_one_that_learns(layers, candidates):
    """The scores of candidates in maps that a robot could have; in a batch, with room left."""
    network = ViewpointGATv2(candidates=candidates, hidden=5, heads=3, layers=layers)
    generator = torch.Generator().manual_seed(layers)
    for parameter in network.parameters():
        parameter.data = torch.randn(parameter.shape, generator=generator) / 3
    network.mean.copy_(torch.rand(len(FEATURES), generator=generator))
    network.scale.copy_(1 + torch.rand(len(FEATURES), generator=generator))
    lines, rows = sight(5.0, 13), []
    stride = 13 + 2 * lines.margin
    for seed in range(1, 21, 2):
        cells, position = known(seed, 5.0)
        views = blank(13, 13, lines)
        start = look(views, lines, cells.numpy(), *position.tolist())
        memory = Memory(np.zeros(2), np.array([-1]), np.zeros(2, np.int64))
        rows.append(
            compared(
                views, lines, stride, paths_from(views, lines, start), memory, network.pack(), SHARE
            )
        )
    features = torch.zeros(len(rows), candidates, len(FEATURES), dtype=torch.float64)
    places, there = torch.zeros(len(rows), candidates, 2), torch.zeros(len(rows), candidates).bool()
    for i, (cells, _, values) in enumerate(rows):
        features[i, : len(cells)] = torch.from_numpy(values)
        places[i, : len(cells), 0] = torch.from_numpy(cells // stride)
        places[i, : len(cells), 1] = torch.from_numpy(cells % stride)
        there[i, : len(cells)] = True
    scores = network(features, places, there)
    assert sum(len(cells) for cells, *_ in rows) > 15
    for i, (cells, found, _) in enumerate(rows):
        np.testing.assert_allclose(found, scores[i, : len(cells)].detach(), rtol=1e-4, atol=1e-4)


def test_an_attention_layer_is_pytorch_geometrics():
    from torch_geometric.nn import GATv2Conv

    network = ViewpointGATv2(hidden=4, heads=3)
    layer, n = network.layers[0], 6
    theirs = GATv2Conv(12, 4, heads=3, edge_dim=3, add_self_loops=False)
    names = {"lin_l": layer.left, "lin_r": layer.right, "lin_edge": layer.edge}
    for name, ours in names.items():
        getattr(theirs, name).load_state_dict(ours.state_dict())
    theirs.att.data = layer.attention.data[None]
    torch.nn.init.zeros_(theirs.bias)
    x, edges = torch.randn(n, 12), torch.randn(n, n, 3)  # [target, source, 3]
    pairs = torch.cartesian_prod(torch.arange(n), torch.arange(n))
    expected = theirs(x, torch.stack([pairs[:, 1], pairs[:, 0]]), edges.reshape(-1, 3))
    found = layer(x[None], edges[None], torch.ones(1, n, dtype=torch.bool))[0]
    torch.testing.assert_close(found, expected, rtol=1e-5, atol=1e-5)


@each(SEEDS)
def test_it_walks_to_the_candidate_with_the_highest_score(seed):
    cells, position = known(seed, 3.0)
    network = explorer(seed, 3.0)
    td = network.make_policy()(TensorDict({K.CELLS: cells, K.POSITION: position}))
    lines = sight(3.0, cells.shape[1])
    stride = cells.shape[1] + 2 * lines.margin
    views = blank(*cells.shape, lines)
    start = look(views, lines, cells.numpy(), *position.tolist())
    memory = Memory(np.zeros(2), np.array([-1]), np.zeros(2, np.int64))
    found, scores, _ = compared(
        views, lines, stride, paths_from(views, lines, start), memory, network.pack(), SHARE
    )
    goal = td["planner", "goal"].item()
    assert goal == (found[scores.argmax()] if len(found) else -1)
