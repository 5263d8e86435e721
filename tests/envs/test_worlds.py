"""Where arenas come from: random forests, and whatever a user injects."""

import pytest
import torch
from torchrl.envs import check_env_specs

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import ForestEnv, RandomForest
from tests.drawing import world
from tests.envs.worlds import MAX_FRONTIERS, make_transformed
from tests.states import seeded

ISLANDS = """
    A . T .
    . T . T
    T . . .
"""


class Drawn:
    """A user's own source: always the same drawing, and not square."""

    def __init__(self, text=ISLANDS):
        self.trees, self.position = world(text)
        self.shape = tuple(self.trees.shape)

    def sample(self, batch, *, generator):
        return self.trees.expand(*batch, *self.shape), self.position.expand(*batch, 2)


@pytest.mark.parametrize("batch", [(), (7,), (2, 3)])
@pytest.mark.parametrize("shape", [(9, 9), (5, 14), (14, 5)])
def test_a_random_forest_has_a_free_start_in_its_largest_component(batch, shape):
    forest = RandomForest(shape, n_trees=6, tree_radius=(0.5, 1.5))
    trees, start = forest.sample(batch, generator=seeded(1))
    assert trees.shape == (*batch, *shape) and start.shape == (*batch, 2)
    largest = F.largest_component(~trees)
    assert F.gather(largest, start.unsqueeze(-2), outside=False).all()


def test_a_random_forest_follows_its_generator_and_nothing_else():
    forest = RandomForest(9, n_trees=6, tree_radius=(0.5, 1.5))
    before = torch.get_rng_state()
    first, again = (forest.sample((3,), generator=seeded(4)) for _ in range(2))
    assert all(map(torch.equal, first, again))
    assert not torch.equal(first[0], forest.sample((3,), generator=seeded(5))[0])
    assert torch.equal(torch.get_rng_state(), before)


def test_a_side_means_a_square():
    assert RandomForest(12).shape == (12, 12) == RandomForest((12, 12)).shape
    assert RandomForest([8, 12]).shape == (8, 12)


def test_a_forest_without_a_free_cell_is_drawn_again():
    """Of such forests some have no free cell; none of 300 comes out so."""
    forest, generator = RandomForest(3, n_trees=2, tree_radius=(1.0, 2.2)), seeded(0)
    drawn = F.sample_trees(
        (300,), shape=(3, 3), n_trees=2, tree_radius=(1.0, 2.2), generator=generator
    )
    assert drawn.flatten(1).all(-1).any()
    trees, start = forest.sample((300,), generator=seeded(0))
    assert not F.gather(trees, start.unsqueeze(-2), outside=True).any()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"shape": 2}, r"shape=2 is not allowed: .*from 3 to 1000"),
        ({"shape": (3, 2)}, r"shape=\[3,2\] is not allowed"),
        ({"shape": (3, 3, 3)}, r"shape=\[3,3,3\] is not allowed"),
        ({"shape": 4.5}, r"shape=4.5 is not allowed"),
        ({"n_trees": -1}, "n_trees=-1 is not allowed: .* from 0 to"),
        ({"tree_radius": (3.0, 1.0)}, r"tree_radius=\[3.0,1.0\] .*\[smallest, largest\]"),
        ({"tree_radius": (0.0, 1.0)}, r"tree_radius=\[0.0,1.0\] .*numbers more than 0"),
    ],
)
def test_a_forest_that_makes_no_sense_is_refused(settings, message):
    with pytest.raises((ValueError, TypeError), match=message):
        RandomForest(**settings)


def test_a_forest_that_fills_its_arena_is_refused_when_the_env_is_made():
    with pytest.raises(ValueError, match=r"n_trees=5000 .* no free cell in an arena of 5 x 9"):
        ForestEnv(RandomForest((5, 9), n_trees=5000))


def test_an_env_takes_any_source_of_worlds():
    env = ForestEnv(Drawn(), num_envs=3)
    td = env.reset()
    assert td[K.TREES].shape == (3, 3, 4) and torch.equal(td[K.TREES][1], Drawn().trees)
    assert td[K.TRAVERSABLE].sum((-2, -1)).tolist() == [8] * 3
    check_env_specs(env)


@pytest.mark.parametrize("num_envs", [None, 4])
@pytest.mark.parametrize("size", [(5, 14), (14, 5)])
def test_arenas_need_not_be_square(size, num_envs):
    env = make_transformed(size=size, num_envs=num_envs, lidar_range=3.0)
    check_env_specs(env, seed=0)
    steps = env.rollout(60, break_when_any_done=False)
    cells, position = steps["next", K.CELLS], steps["next", K.POSITION]
    assert cells.shape[-2:] == size
    assert (position < torch.tensor(size)).all() and (position >= 0).all()
    assert position.flatten(0, -2).amax(0).argmax() == (0 if size[0] > size[1] else 1)
    known = cells != F.Cell.UNKNOWN
    truth = torch.where(steps[K.TREES], int(F.Cell.OCCUPIED), int(F.Cell.FREE))
    assert torch.equal(cells[known].long(), truth[known])
    graph = F.exploration_graph(
        cells, position, window=7, max_frontiers=MAX_FRONTIERS, lidar_range=3.0
    )
    torch.testing.assert_close(steps["next", K.NODES], graph.x, rtol=0, atol=1e-6)


class Wrong(Drawn):
    def __init__(self, change):
        super().__init__()
        self.change = change

    def sample(self, batch, *, generator):
        return self.change(*super().sample(batch, generator=generator))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda trees, start: (trees.long(), start), r"dtype torch.int64: this env takes \(3, 4\)"),
        (lambda trees, start: (trees[:2], start), r"shape \(2, 4\)"),
        (lambda trees, start: (~torch.zeros_like(trees), start), "no free cell"),
        (lambda trees, start: (trees, start + 1), "must be a free cell"),
        (lambda trees, start: (trees, start - 1), "must be a free cell"),
    ],
)
def test_a_source_that_gives_something_else_is_refused_when_the_env_is_made(change, message):
    with pytest.raises(ValueError, match=message):
        ForestEnv(Wrong(change))
