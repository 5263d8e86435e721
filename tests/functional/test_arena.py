"""Trunks, components, starts and coverage."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from forestrl import functional as F
from tests import oracles
from tests.drawing import parse_cells, situation, world
from tests.states import (
    BATCHES,
    assert_batched_equals_singles,
    at,
    cells_of,
    explored_states,
    mask_of,
    masks,
    seeded,
    worlds,
)


def sample(batch=(), *, size=12, n_trees=4, tree_radius=(1.0, 3.0), seed=0):
    shape = (size, size) if isinstance(size, int) else size
    return F.sample_trees(
        batch, shape=shape, n_trees=n_trees, tree_radius=tree_radius, generator=seeded(seed)
    )


def trunk_probability(size: int, tree_radius: tuple[float, float]) -> torch.Tensor:
    """The chance ``[H, W]`` that one trunk occupies a cell: its centre within the radius.

    The average of P(radius >= distance) over 20 x 20 trunk centres in each cell.
    """
    low, high = tree_radius
    fine = (torch.arange(20 * size) + 0.5) / 20
    cell = torch.arange(size) + 0.5
    squares = (fine - cell.unsqueeze(-1)).square()  # [H, 20 H]
    distance = (squares[:, None, :, None] + squares[None, :, None, :]).sqrt()
    reaches = ((high - distance) / (high - low)).clamp(0, 1)
    return reaches.mean((-2, -1))


@pytest.mark.parametrize("batch", BATCHES)
def test_trunks_fill_a_mask_for_each_arena_of_the_batch(batch):
    trees = sample(batch)
    assert trees.shape == (*batch, 12, 12)
    assert trees.dtype == torch.bool
    if batch:
        assert len({tuple(arena.flatten().tolist()) for arena in trees.flatten(0, -3)}) > 1


def test_trunks_are_absent_from_an_arena_without_any():
    assert not sample((3,), n_trees=0).any()


def test_trunks_lie_within_their_radius():
    """Two cells of one trunk have centres within r of its own, so within 2 r of each other."""
    for arena in sample((200,), n_trees=1, tree_radius=(1.0, 2.0)):
        occupied = sorted(cells_of(arena))
        assert max(math.dist(a, b) for a in occupied for b in occupied) <= 4.0


def test_trunks_of_one_cell_radius_always_occupy_the_cell_they_stand_in():
    """No point of a cell is further than sqrt(2) / 2 < 1 from the centre of the cell."""
    assert sample((200,), n_trees=1, tree_radius=(1.0, 1.0)).flatten(1).any(-1).all()


def test_a_trunk_occupies_the_cells_whose_centre_lies_within_its_radius():
    """The centre of (2, 2) is (2.5, 2.5); its four neighbours' centres lie on the rim, at 1."""
    arena = F.rasterize(torch.tensor([[2.5, 2.5]]), torch.tensor([1.0]), shape=(5, 5))
    assert cells_of(arena) == {(2, 2), (1, 2), (3, 2), (2, 1), (2, 3)}
    # From (3.0, 1.0) the centres of four cells are sqrt(1/2) = 0.707 away, the next sqrt(5/2).
    arena = F.rasterize(torch.tensor([[3.0, 1.0]]), torch.tensor([0.75]), shape=(5, 5))
    assert cells_of(arena) == {(2, 0), (2, 1), (3, 0), (3, 1)}


def test_a_trunk_at_the_border_is_cut_by_it_and_does_not_wrap_around():
    arena = F.rasterize(torch.tensor([[0.0, 4.9]]), torch.tensor([1.5]), shape=(5, 5))
    # (0, 4) at hypot(0.5, 0.4), (1, 4) at hypot(1.5, 0.4) > 1.5, (0, 3) at hypot(0.5, 1.4) = 1.487
    assert cells_of(arena) == {(0, 4), (0, 3)}


def test_trunks_may_overlap():
    arena = F.rasterize(
        torch.tensor([[0.5, 0.5], [0.5, 1.0]]), torch.tensor([0.5, 0.5]), shape=(2, 2)
    )
    assert cells_of(arena) == {(0, 0), (0, 1)}


def test_trunks_thinner_than_a_cell_occupy_it_only_if_its_centre_lies_within():
    """A radius of 0.5 covers a centre in pi / 4 of all cases, and never two."""
    trees = sample((2000,), size=20, n_trees=1, tree_radius=(0.5, 0.5))
    occupied = trees.flatten(1).sum(-1)
    assert occupied.max() == 1
    assert occupied.double().mean() == pytest.approx(math.pi / 4, abs=4 * 0.41 / 2000**0.5)


def test_trunks_are_as_many_as_asked_for():
    """Of 30 trunks of radius 0.5 in 400 cells, 400 (1 - (1 - pi/4/400)^30) cells are expected."""
    occupied = sample((2000,), size=20, n_trees=30, tree_radius=(0.5, 0.5)).flatten(1).sum(-1)
    expected = 400 * (1 - (1 - math.pi / 4 / 400) ** 30)
    assert occupied.max() <= 30
    assert occupied.double().mean() == pytest.approx(expected, abs=4 * 2.5 / 2000**0.5)


def test_trunks_have_uniform_centres_and_uniform_radii():
    n_trees, arenas = 3, 4000
    one = trunk_probability(10, (1.0, 3.0))
    expected = 1 - (1 - one) ** n_trees
    trees = sample((arenas,), size=10, n_trees=n_trees)
    share = trees.float().mean(0)
    error = (expected * (1 - expected) / arenas).sqrt()
    assert ((share - expected).abs() < 5 * error).all()
    assert share.mean().item() == pytest.approx(expected.mean().item(), abs=0.01)


@pytest.mark.parametrize("shape", [(6, 20), (20, 6)])
def test_trunks_fill_an_arena_that_is_not_square_evenly(shape):
    """Thin trunks, one an arena: every cell is hit about as often as the others."""
    trees = sample((4000,), size=shape, n_trees=1, tree_radius=(0.5, 0.5))
    assert trees.shape == (4000, *shape)
    for side in (1, 2):
        hits = trees.sum((0, 3 - side)).float()
        expected = 4000 * math.pi / 4 / shape[side - 1]
        assert (hits - expected).abs().max() < 5 * expected**0.5


def test_trunks_are_those_of_the_generator():
    assert torch.equal(sample((3,), seed=4), sample((3,), seed=4))
    assert not torch.equal(sample((3,), seed=4), sample((3,), seed=5))


def test_sampling_leaves_the_global_generator_alone():
    before = torch.get_rng_state()
    trees = sample((3,))
    F.sample_position(~trees, seeded(0))
    assert torch.equal(torch.get_rng_state(), before)


def test_component_connects_diagonals_but_not_through_trunks():
    trees, position = world("""
        A T . .
        T . T .
        T T T .
        . T . T
    """)
    # (0, 0) - (1, 1) - (0, 2) - (0, 3) - (1, 3) - (2, 3) - (3, 2); (3, 0) is sealed
    expected = {(0, 0), (1, 1), (0, 2), (0, 3), (1, 3), (2, 3), (3, 2)}
    assert cells_of(F.component(~trees, position)) == expected


def test_the_largest_component_is_the_one_with_most_cells():
    free = parse_cells("""
        . T . .
        . T . .
        T T . T
    """).eq(F.Cell.FREE)
    assert cells_of(F.largest_component(free)) == {(0, 2), (0, 3), (1, 2), (1, 3), (2, 2)}


def test_a_component_may_wind_through_the_whole_arena():
    trees, position = world("""
        A . . . . .
        T T T T T .
        . . . . . .
        . T T T T T
        . . . . . .
    """)
    assert torch.equal(F.component(~trees, position), ~trees)
    assert torch.equal(F.largest_component(~trees), ~trees)


@given(worlds())
def test_components_match_the_search(state):
    trees, position = state
    found = oracles.components((~trees).tolist())
    own = F.component(~trees, position)
    assert own.dtype == torch.bool
    assert cells_of(own) == next(cells for cells in found if at(position) in cells)
    largest = F.largest_component(~trees)
    assert largest.dtype == torch.bool
    assert cells_of(largest) in found
    assert largest.sum() == max(map(len, found))


@pytest.mark.parametrize("batch", BATCHES)
def test_components_of_a_stack_are_the_stack_of_components(batch):
    trees, _, position = explored_states(2, batch, density=0.45)
    assert_batched_equals_singles(F.component, ~trees, position, batch=batch)
    assert_batched_equals_singles(F.largest_component, ~trees, batch=batch)


@given(masks(), st.integers(0, 100))
def test_starts_are_cells_of_the_mask(mask, seed):
    mask = mask.clone()
    mask[0, 0] = True
    position = F.sample_position(mask, seeded(seed))
    assert position.shape == (2,) and position.dtype == torch.int64
    assert mask[at(position)]
    assert torch.equal(position, F.sample_position(mask, seeded(seed)))


def test_starts_are_uniform_over_the_mask():
    """6000 draws over 6 cells: 1000 each, with a deviation of sqrt(6000 * 1/6 * 5/6) = 28.9."""
    mask = mask_of({(0, 0), (0, 1), (1, 3), (2, 2), (4, 0), (4, 4)}, torch.zeros(5, 5))
    position = F.sample_position(mask.expand(6000, 5, 5), seeded(0))
    counts = torch.bincount(position[:, 0] * 5 + position[:, 1], minlength=25).reshape(5, 5)
    assert torch.equal(counts > 0, mask)
    assert (counts[mask] - 1000).abs().max() < 4.5 * 28.9


@pytest.mark.parametrize("batch", BATCHES)
def test_starts_have_the_shape_of_the_batch(batch):
    free = ~sample(batch)
    position = F.sample_position(free, seeded(1))
    assert position.shape == (*batch, 2)
    stacked = free.reshape(-1, 12, 12)
    assert all(m[at(p)] for m, p in zip(stacked, position.reshape(-1, 2), strict=True))


def test_coverage_is_the_known_share_of_the_traversable_cells():
    cells, _ = situation("""
        A . ?
        T T T
        . . ?
    """)
    traversable = mask_of({(0, 0), (0, 1), (0, 2)}, cells)
    share = F.coverage(cells, traversable)
    assert share.shape == (1,) and share.dtype == torch.float32
    assert share.item() == pytest.approx(2 / 3)  # the pocket below does not count


@pytest.mark.parametrize("batch", BATCHES)
def test_coverage_of_a_stack_is_the_stack_of_coverages(batch):
    trees, cells, position = explored_states(3, batch)
    traversable = F.component(~trees, position)
    assert_batched_equals_singles(F.coverage, cells, traversable, batch=batch)
