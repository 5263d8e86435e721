"""Forests by trunks a hectare: how many, how far apart, and where."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import pdist
from torchrl.envs import check_env_specs

from forestrl import functional as F
from forestrl.envs import ForestEnv, HardCoreForest, Plantation, PoissonForest
from tests.states import seeded

SIDES = (80.0, 120.0)  # metres: 0.96 hectares
KINDS = [PoissonForest, HardCoreForest, Plantation]


@pytest.mark.parametrize(
    ("density", "kind"), [(0, PoissonForest), (700, PoissonForest), (700, HardCoreForest)]
)
def test_as_many_trunks_stand_on_a_hectare_as_asked_for(kind, density):
    forest, generator = kind(density=density), seeded(0)
    counts = [len(forest.places(SIDES, generator)) for _ in range(30)]
    expected = density * 0.96
    assert abs(np.mean(counts) - expected) <= 4 * math.sqrt(expected / 30)


def test_a_poisson_forests_counts_vary_as_much_as_their_mean():
    generator = seeded(1)
    counts = [len(PoissonForest(density=500).places((20.0, 20.0), generator)) for _ in range(600)]
    assert np.var(counts) == pytest.approx(20, rel=0.25) and np.mean(counts) == pytest.approx(
        20, rel=0.05
    )


@given(st.floats(0.2, 3.0), st.integers(0, 2**32))
def test_hard_core_trunks_keep_their_distance(distance, seed):
    density = 0.9 * 10_000 / (math.pi * distance**2)
    places = HardCoreForest(density=min(density, 3000), distance=distance).places(
        (15.0, 10.0), seeded(seed)
    )
    assert len(places) < 2 or pdist(places.double().numpy()).min() >= distance - 1e-5


def test_more_trunks_than_can_keep_the_distance_are_refused():
    """A circle of 1.5 m has 7.07 square metres: 0.95 of 10,000 / 7.07 is 1343."""
    with pytest.raises(ValueError, match=r"density=1400 is not allowed: .*at most 1343 .*1.5 m"):
        HardCoreForest(density=1400)


def test_plantation_rows_are_as_far_apart_as_asked_for():
    places = Plantation(spacing=(4.0, 2.5), jitter=0.0).places((20.0, 30.0), seeded(2))
    rows, along = (np.unique(axis.numpy().round(3)) for axis in places.T)
    assert np.diff(rows) == pytest.approx(4.0, abs=2e-3)
    assert np.diff(along) == pytest.approx(2.5, abs=2e-3)
    assert len(places) == len(rows) * len(along)
    assert rows[0] <= 0 <= 20 <= rows[-1] and along[0] <= 0 <= 30 <= along[-1]


def test_plantation_trunks_are_off_by_the_jitter_at_most():
    neat, off = (Plantation(jitter=j).places(SIDES, seeded(3)) for j in (0.0, 0.3))
    inside = ((off > 0) & (off < torch.tensor(SIDES))).all(1)
    nearest = torch.cdist(off[inside], neat, p=torch.inf).amin(1)
    assert 0.2 < nearest.max() <= 0.3 + 1e-4


@pytest.mark.parametrize("kind", KINDS)
def test_a_forest_in_metres_has_a_free_start_in_its_largest_component(kind):
    forest = kind((12, 31), cell_size=0.4)
    trees, start = forest.sample((2, 3), generator=seeded(1))
    assert trees.shape == (2, 3, 12, 31)
    assert F.gather(F.largest_component(~trees), start.unsqueeze(-2), outside=False).all()
    again, other = (forest.sample((2, 3), generator=seeded(seed))[0] for seed in (1, 2))
    assert torch.equal(trees, again) and not torch.equal(trees, other)
    check_env_specs(ForestEnv(forest, num_envs=2, seed=0))


@pytest.mark.parametrize("kind", KINDS)
def test_trunks_reach_in_from_outside(kind):
    """Trunks of 10 m: the border is occupied as often as the middle."""
    options = {"jitter": 0.0, "spacing": (40.0, 40.0)} if kind is Plantation else {"density": 10.0}
    forest = kind(21, cell_size=1.0, dbh=(999.0, 1000.0), robot_radius=0.0, **options)
    share = torch.stack([forest.sample((), generator=seeded(i))[0] for i in range(300)]).float()
    share = share.mean(0)
    assert share[0].mean().item() == pytest.approx(share[10].mean().item(), abs=0.06)


@pytest.mark.parametrize("kind", KINDS)
def test_a_robots_radius_takes_room(kind):
    slim, wide = (kind(40, robot_radius=radius, cell_size=0.2) for radius in (0.0, 0.6))
    taken = [forest.sample((4,), generator=seeded(0))[0].float().mean() for forest in (slim, wide)]
    assert taken[0] < taken[1]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cell_size": 0}, "cell_size=0 is not allowed: .* more than 0"),
        ({"robot_radius": -1}, "robot_radius=-1 is not allowed"),
        ({"dbh": (40, 20)}, r"dbh=\[40,20\] is not allowed: it must be \[smallest, largest\]"),
        ({"shape": 2}, "shape=2 is not allowed"),
    ],
)
def test_a_forest_that_makes_no_sense_is_refused(kind, settings, message):
    with pytest.raises(ValueError, match=message):
        kind(**settings)


def test_a_forest_that_leaves_no_room_is_refused():
    with pytest.raises(ValueError, match=r"trunks a hectare.*no cell is free; take fewer"):
        ForestEnv(PoissonForest(10, density=100_000, robot_radius=2.0))
