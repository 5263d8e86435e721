"""Every compiled function equals the torch function of the same name."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from forestrl import functional as F
from forestrl import kernels
from forestrl.kernels import graph, paths, sensing
from tests.states import (
    BATCHES,
    assert_batched_equals_singles,
    columns_first,
    explored_states,
    maps,
    masks,
    random_state,
    tensors_of,
    worlds,
)

COMPILE = """
import torch
from forestrl import functional as F, kernels
from forestrl.kernels.sensing import are_compiled
assert not are_compiled()
free = torch.ones(3, 3, dtype=torch.bool)
cells, position = torch.zeros(3, 3, dtype=torch.uint8), torch.tensor([1, 1])
kernels.sense(~free, free, cells, position, F.sight_lines(2.0))
assert are_compiled()
"""

TESTED = {
    "exploration_graph",
    "potential",
    "path_lengths",
    "component",
    "largest_component",
    "sense",
}


def assert_same(compiled, reference) -> None:
    """Integers and booleans exactly, floats to 1e-6, shapes and dtypes alike."""
    for ours, theirs in zip(tensors_of(compiled), tensors_of(reference), strict=True):
        torch.testing.assert_close(ours, theirs, rtol=0, atol=1e-6)


def states(seed: int, batch: tuple[int, ...]):
    """Maps of all kinds: drawn cell by cell, not square, and as a robot would know them."""
    yield random_state(seed, batch)
    yield random_state(seed + 1, batch, height=7, width=12)
    yield explored_states(seed, batch)[1:]
    yield explored_states(seed + 1, batch, density=0.4, lidar_range=2.5)[1:]


def test_every_compiled_function_is_tested_here():
    assert set(kernels.__all__) == TESTED


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize(
    "options",
    [
        {"window": 7, "max_frontiers": 64, "lidar_range": 5.0},
        {"window": 3, "max_frontiers": 5, "lidar_range": 2.5},  # overflows
        {"window": 1, "max_frontiers": 256, "lidar_range": 8.0},
    ],
)
def test_the_compiled_exploration_graph_equals_the_reference(batch, seed, options):
    for cells, position in states(seed, batch):
        ours = graph.exploration_graph(cells, position, **options)
        assert isinstance(ours, F.Graph)
        assert_same(ours, F.exploration_graph(cells, position, **options))


@given(maps(max_side=9), st.sampled_from([1, 3, 5, 7]), st.integers(1, 90))
def test_the_compiled_exploration_graph_equals_the_reference_on_any_map(state, window, room):
    options = {"window": window, "max_frontiers": room, "lidar_range": 5.0}
    assert_same(graph.exploration_graph(*state, **options), F.exploration_graph(*state, **options))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize(("window", "beta"), [(7, 0.5), (3, 0.0), (5, 1.0)])
def test_the_compiled_potential_equals_the_reference(batch, seed, window, beta):
    for cells, position in states(seed, batch):
        ours = graph.potential(cells, position, window=window, beta=beta)
        assert_same(ours, F.potential(cells, position, window=window, beta=beta))


@given(maps(max_side=9), st.sampled_from([1, 3, 5, 7]), st.floats(0, 2))
def test_the_compiled_potential_equals_the_reference_on_any_map(state, window, beta):
    ours = graph.potential(*state, window=window, beta=beta)
    assert_same(ours, F.potential(*state, window=window, beta=beta))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("batch", BATCHES)
def test_the_compiled_path_lengths_and_components_equal_the_reference(batch, seed):
    for cells, position in states(seed, batch):
        free = cells == F.Cell.FREE
        assert_same(paths.path_lengths(free, position), F.path_lengths(free, position))
        assert_same(paths.component(free, position), F.component(free, position))
        assert_same(paths.largest_component(free), F.largest_component(free))


@given(masks(max_side=9), st.data())
def test_the_compiled_paths_equal_the_reference_from_any_cell(free, data):
    """Also from cells that are not free, with components of equal size, and with none at all."""
    height, width = free.shape
    source = torch.tensor(
        [data.draw(st.integers(0, height - 1)), data.draw(st.integers(0, width - 1))]
    )
    assert_same(paths.path_lengths(free, source), F.path_lengths(free, source))
    assert_same(paths.component(free, source), F.component(free, source))
    assert_same(paths.largest_component(free), F.largest_component(free))


@pytest.mark.parametrize("lidar_range", [1.5, 2.5, 5.0, 8.0])
@pytest.mark.parametrize("batch", BATCHES)
def test_the_compiled_scan_equals_the_reference(batch, lidar_range):
    lines = F.sight_lines(lidar_range)
    trees, cells, position = explored_states(20, batch)
    traversable = F.component(~trees, position)
    for before in (cells, torch.zeros_like(cells)):
        ours = sensing.sense(trees, traversable, before, position, lines)
        assert_same(ours, F.sense(trees, traversable, before, position, lines))


@given(worlds())
def test_the_compiled_scan_equals_the_reference_on_any_world(state):
    trees, position = state
    lines, nothing = F.sight_lines(4.0), torch.zeros_like(trees, dtype=torch.uint8)
    traversable = F.component(~trees, position)
    ours = sensing.sense(trees, traversable, nothing, position, lines)
    assert_same(ours, F.sense(trees, traversable, nothing, position, lines))


@pytest.mark.parametrize("batch", BATCHES)
def test_compiled_functions_of_a_stack_are_the_stack_of_functions(batch):
    trees, cells, position = explored_states(22, batch)
    free, lines = cells == F.Cell.FREE, F.sight_lines(5.0)

    def graphs(c, p):
        return graph.exploration_graph(c, p, window=7, max_frontiers=40, lidar_range=5.0)

    def potentials(c, p):
        return graph.potential(c, p, window=7, beta=0.5)

    for function in (graphs, potentials):
        assert_batched_equals_singles(function, cells, position, batch=batch)
    for function in (paths.path_lengths, paths.component):
        assert_batched_equals_singles(function, free, position, batch=batch)
    assert_batched_equals_singles(paths.largest_component, free, batch=batch)
    assert_batched_equals_singles(
        lambda t, c, p: sensing.sense(t, ~t, c, p, lines), trees, cells, position, batch=batch
    )


def test_compiled_functions_leave_their_inputs_as_they_were():
    trees, cells, position = explored_states(23, (3,))
    free = cells == F.Cell.FREE
    before = [x.clone() for x in (trees, cells, position, free)]
    kernels.exploration_graph(cells, position, window=7, max_frontiers=9, lidar_range=5.0)
    kernels.potential(cells, position, window=7, beta=0.5)
    kernels.path_lengths(free, position)
    kernels.largest_component(columns_first(free))
    kernels.sense(trees, ~trees, cells, position, F.sight_lines(5.0))
    for now, then in zip((trees, cells, position, free), before, strict=True):
        assert torch.equal(now, then)


def test_kernels_are_compiled_once_for_all_processes(tmp_path):
    folder = dict(os.environ, NUMBA_CACHE_DIR=str(tmp_path))
    subprocess.run([sys.executable, "-c", COMPILE], env=folder, check=True)
