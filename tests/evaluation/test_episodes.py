"""Episodes by hand, and the same in any company."""

import gc
from dataclasses import fields

import numpy as np
import pytest
import torch
from torchrl.envs import TransformedEnv

from forestrl import keys as K
from forestrl.envs import ExplorationGraph
from forestrl.evaluation import Episodes, evaluate, uniforms
from forestrl.evaluation.arenas import draw_arenas as arenas_of
from forestrl.planners import CostBased, NearestFrontier
from tests.envs.worlds import forest_env
from tests.evaluation.policies import always, forest, meadow, random_action, random_logits

SIDE = 9  # of the meadow
STEPS = 20


def starts(indices):
    return arenas_of(meadow(1), 0, indices)[K.POSITION].numpy()


def run(factory, policy, *, indices=range(6), steps=STEPS, batch=4, **options):
    return evaluate(factory, policy, seed=0, indices=indices, steps=steps, batch=batch, **options)


def written(coverage, **columns):
    """Episodes with a written-down coverage."""
    coverage = np.array(coverage, dtype=np.float32)
    n, steps = coverage.shape[0], coverage.shape[1] - 1
    zeros = np.zeros(n, dtype=np.int32)
    values = {field.name: zeros for field in fields(Episodes)}
    values |= {"index": np.arange(n), "coverage": coverage}
    values |= {"intervened": np.zeros((n, steps), dtype=bool)}
    return Episodes(**values | columns)


def assert_same(first, second, rows=slice(None)):
    for field in fields(Episodes):
        np.testing.assert_array_equal(
            getattr(first, field.name), getattr(second, field.name)[rows], err_msg=field.name
        )


@pytest.mark.parametrize("policy", [random_action, random_logits])
def test_an_arena_fares_the_same_alone_and_among_a_hundred(policy):
    alone = run(forest, policy, indices=[7], steps=60)
    among = run(forest, policy, indices=range(100), steps=60, batch=100)
    assert_same(alone, among, slice(7, 8))


@pytest.mark.parametrize("policy", [random_logits, NearestFrontier(), CostBased()])
def test_an_episode_keeps_no_tensor_of_the_steps_behind_it(policy):
    alive = []

    def weigh(done):
        if done in (4 * 30, 4 * 90):
            gc.collect()
            tensors = [x for x in gc.get_objects() if issubclass(type(x), torch.Tensor)]
            storages = {x.untyped_storage().data_ptr(): x.untyped_storage() for x in tensors}
            alive.append(sum(storage.nbytes() for storage in storages.values()))

    run(forest, policy, indices=range(4), steps=100, progress=weigh)
    assert alive[0] == alive[1] > 0


def test_batches_do_not_matter_even_if_the_last_is_smaller():
    sizes = []

    def factory(n):
        sizes.append(n)
        return forest(n)

    chunked = run(factory, random_action, indices=range(3, 13), batch=4)
    assert sizes == [4, 2]
    assert_same(chunked, run(forest, random_action, indices=range(3, 13), batch=10))
    np.testing.assert_array_equal(chunked.index, range(3, 13))


def test_another_seed_gives_other_episodes():
    first = run(forest, random_action)
    second = evaluate(forest, random_action, seed=1, indices=range(6), steps=STEPS, batch=4)
    assert (first.coverage != second.coverage).any()


def test_shapes_and_types():
    episodes = run(forest, random_action)
    assert episodes.coverage.shape == (6, STEPS + 1) and episodes.coverage.dtype == np.float32
    assert episodes.intervened.shape == (6, STEPS) and episodes.intervened.dtype == np.bool_
    for name in ("collisions", "null_actions", "truncated_graphs"):
        assert getattr(episodes, name).dtype == np.int32
    assert episodes.path_length.dtype == episodes.free_share.dtype == np.float32
    assert len(episodes) == 6 and episodes.steps == STEPS


def test_straight_into_the_fence_without_a_filter():
    """East until the last column; then every step collides and nothing moves."""
    episodes = run(meadow, always(5))
    moves = SIDE - 1 - starts(range(6))[:, 1]
    np.testing.assert_array_equal(episodes.path_length, moves)
    np.testing.assert_array_equal(episodes.collisions, STEPS - moves)
    assert not episodes.intervened.any() and not episodes.null_actions.any()


def test_diagonal_moves_are_longer():
    episodes = run(meadow, always(8))
    moves = (SIDE - 1 - starts(range(6))).min(1)
    np.testing.assert_allclose(episodes.path_length, moves * 2**0.5, rtol=1e-6)


def test_straight_into_the_fence_with_the_filter():
    """At the fence 4, west, replaces 5, east (the lower of two as near); then 5 is feasible."""
    episodes = run(lambda n: forest(n, size=SIDE, n_trees=0), always(5))
    moves = SIDE - 1 - starts(range(6))[:, 1]
    steps = np.arange(STEPS)
    expected = (steps >= moves[:, None]) & ((steps - moves[:, None]) % 2 == 0)
    np.testing.assert_array_equal(episodes.intervened, expected)
    np.testing.assert_array_equal(episodes.path_length, STEPS)
    np.testing.assert_allclose(episodes.intervention_rate(), expected.mean(1))
    assert not episodes.collisions.any()


def test_staying_in_place():
    episodes = run(lambda n: forest(n, max_frontiers=1), always(0))
    np.testing.assert_array_equal(episodes.null_actions, STEPS)
    np.testing.assert_array_equal(episodes.path_length, 0)
    np.testing.assert_array_equal(episodes.truncated_graphs, STEPS)  # more than one frontier cell
    assert (episodes.coverage == episodes.coverage[:, :1]).all()


def test_there_may_be_no_graph():
    assert not run(lambda n: forest(n, graph=False), random_action).truncated_graphs.any()


def test_there_may_be_a_graph_and_no_filter():
    def factory(n):
        return TransformedEnv(forest_env(size=SIDE, num_envs=n, n_trees=1), ExplorationGraph())

    assert not run(factory, random_action).intervened.any()


def test_the_policy_sees_this_steps_draw_and_no_gradient_is_kept():
    seen = []

    def policy(td):
        assert not torch.is_grad_enabled()
        seen.append(td[K.UNIFORM].clone())
        return random_action(td)

    run(forest, policy, indices=range(3), steps=5)
    assert torch.equal(torch.stack(seen, -1), uniforms(0, range(3), 5))


def test_episodes_run_on_past_goal_and_budget():
    """Goal and budget of the env are flags: all steps count."""
    episodes = run(lambda n: forest(n, coverage_goal=0.05, max_steps=3), random_action)
    assert (episodes.coverage[:, -1] > episodes.coverage[:, 5]).any()


def test_free_share_counts_sealed_pockets():
    """Without trees all free cells are traversable; with many the share is at most the coverage."""
    episodes = run(meadow, random_action)
    np.testing.assert_allclose(episodes.free_share, episodes.coverage[:, -1], rtol=1e-6)
    dense = run(lambda n: forest(n, n_trees=20), random_action, indices=range(20))
    assert (dense.free_share > 0).all() and (dense.free_share < 1).all()


def test_progress_counts_steps_of_all_arenas():
    told = []
    run(meadow, random_action, indices=range(5), steps=3, batch=2, progress=told.append)
    assert told == [2, 4, 6, 8, 10, 12, 13, 14, 15]


@pytest.mark.parametrize("name", ["steps", "batch"])
def test_nothing_to_run_is_an_error(name):
    with pytest.raises(ValueError, match=f"{name}=0"):
        run(meadow, random_action, **{name: 0})
    with pytest.raises(ValueError, match=r"len\(indices\)=0"):
        run(meadow, random_action, indices=[])


def test_steps_to_a_level():
    episodes = written([[0.1, 0.5, 0.8, 0.9], [0.8, 0.8, 0.8, 0.8], [0.0, 0.1, 0.2, 0.79]])
    np.testing.assert_array_equal(episodes.steps_to(0.8), [2, 0, np.nan])


def test_area_under_the_curve():
    """(0.0 + 1.0)/2 and (1.0 + 0.5)/2: 0.5 over the first step, 1.25/2 over both."""
    episodes = written([[0.0, 1.0, 0.5]])
    np.testing.assert_allclose(episodes.area_under_curve(1), [0.5])
    np.testing.assert_allclose(episodes.area_under_curve(2), [0.625])
    for upto in (0, 3):
        with pytest.raises(ValueError, match=f"upto={upto}"):
            episodes.area_under_curve(upto)


def test_mean_curve():
    """0.4 and 0.6: mean 0.5, standard deviation 0.1414, standard error 0.1, margin 0.196."""
    curve = written([[0.4, 1.0], [0.6, 1.0]]).mean_curve()
    np.testing.assert_allclose(curve.mean, [0.5, 1.0])
    np.testing.assert_allclose(curve.low, [0.304, 1.0], atol=1e-4)
    np.testing.assert_allclose(curve.high, [0.696, 1.0], atol=1e-4)


def test_one_arena_has_no_interval():
    curve = written([[0.4, 1.0]]).mean_curve()
    np.testing.assert_allclose(curve.mean, [0.4, 1.0])
    assert np.isnan(curve.low).all() and np.isnan(curve.high).all()


def test_concatenation():
    first, second = written([[0.0, 0.1]]), written([[0.2, 0.3], [0.4, 0.5]])
    joined = Episodes.concatenate([first, second])
    np.testing.assert_allclose(joined.coverage[:, 0], [0.0, 0.2, 0.4])
    for parts in ([], [first, written([[0.0, 0.1, 0.2]])]):
        with pytest.raises(ValueError, match="one length"):
            Episodes.concatenate(parts)
