"""The states that are measured in."""

import pytest
import torch

from forestrl import functional as F
from forestrl import keys as K
from forestrl.benchmark.run import describe
from forestrl.benchmark.states import arrange, enter, explore
from forestrl.envs import StaggeredEpisodes
from tests.envs.worlds import forest_env, make_transformed


@pytest.fixture(scope="module")
def forest():
    return forest_env(size=(16, 24), n_trees=8, num_envs=6)


@pytest.fixture(scope="module")
def worlds(forest):
    return explore(forest, steps=300)


def test_states_are_explored_and_in_different_phases(worlds, forest):
    start = forest_env(size=(16, 24), n_trees=8, num_envs=6).reset()
    assert torch.equal(worlds[K.TREES], start[K.TREES])
    assert (worlds[K.POSITION] != start[K.POSITION]).any()
    seen, at_first = ((td[K.CELLS] != F.Cell.UNKNOWN).sum((-2, -1)) for td in (worlds, start))
    assert (seen >= at_first).all() and (seen > at_first).any()
    assert len(worlds[K.STEP_COUNT].unique()) > 1
    assert ((worlds[K.STEP_COUNT] >= 1) & (worlds[K.STEP_COUNT] <= 300)).all()


def test_states_are_possible(worlds):
    """No walker stands on a trunk, and what is known agrees with the truth."""
    trees, cells = worlds[K.TREES], worlds[K.CELLS]
    assert not F.gather(trees, worlds[K.POSITION].unsqueeze(-2), outside=True).any()
    assert trees[cells == F.Cell.OCCUPIED].all() and not trees[cells == F.Cell.FREE].any()


def test_states_are_described(worlds):
    about = describe(worlds)
    assert (about["rows"], about["columns"]) == (16, 24)
    counts = F.frontier(worlds[K.CELLS]).flatten(1).sum(1)
    assert about["frontiers"] == pytest.approx(counts.float().mean().item())
    assert about["max_frontiers"] > counts.max() and about["max_frontiers"] % 64 == 0
    assert 0 < about["coverage"] <= 1


@pytest.mark.parametrize(("num_envs", "batches"), [(1, 6), (2, 3), (4, 1), (6, 1), (8, 1)])
def test_batches_are_filled_with_the_pool(num_envs, batches, worlds):
    arranged = arrange(worlds, num_envs)
    assert [len(batch) for batch in arranged] == [num_envs] * batches
    together = torch.cat([batch[K.CELLS] for batch in arranged])
    for i, cells in enumerate(together):
        assert torch.equal(cells, worlds[K.CELLS][i % 6])


def test_entered_env_stands_in_the_world(forest, worlds):
    state = enter(forest, worlds)
    for key in (K.TREES, K.CELLS, K.POSITION, K.STEP_COUNT):
        assert torch.equal(state[key], worlds[key])
    assert state[K.ACTION].tolist() == [0, 1, 2, 3, 4, 5]


def test_entered_training_env_cuts_episodes_after_their_full_length():
    env = make_transformed(num_envs=5)
    env.append_transform(StaggeredEpisodes(400))
    state = enter(env, explore(env.base_env, steps=200))
    assert (state["horizon"] == 400).all()
    assert not env.step(state)["next", "truncated"].any()
