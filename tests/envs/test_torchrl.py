"""The env as users of TorchRL write it: resets, seeds, workers, composition, estimators."""

import itertools

import pytest
import torch
from tensordict import TensorDict
from torchrl.collectors import MultiSyncCollector
from torchrl.envs import Compose, ParallelEnv, SerialEnv, TransformedEnv, set_exploration_type
from torchrl.envs.utils import ExplorationType, step_mdp
from torchrl.objectives.value import GAE

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import (
    ExplorationGraph,
    ForestEnv,
    FrontierPotentialReward,
    RandomForest,
    SafetyFilter,
)
from forestrl.policies.gatv2 import GATv2ActorCritic
from tests.envs.worlds import assert_same_state, env_for, make_forest, make_transformed

ORDERS = list(itertools.permutations((SafetyFilter, ExplorationGraph, FrontierPotentialReward)))
FEW = """
    A . . .
    . T . .
    . . . .
"""


def make_unseeded():
    return ForestEnv(RandomForest(9, n_trees=4, tree_radius=(0.5, 1.0)), num_envs=3)


def differ(trees):
    """Whether no two of the arenas are the same."""
    arenas = trees.flatten(0, -3).flatten(1).tolist()
    return len({tuple(arena) for arena in arenas}) == len(arenas)


# Resets.


def test_a_whole_state_is_restored_and_goes_on_the_same():
    env = make_transformed(num_envs=4)
    torch.manual_seed(0)
    state = step_mdp(env.rollout(9, break_when_any_done=False)[:, -1])
    again = make_transformed(num_envs=4, seed=7).reset(state.clone(), set_state=True)
    keys = [key for key in env.state_spec.keys(True, True)]
    assert_same_state(again.select(*keys), state.select(*keys))
    action = torch.randint(9, (4,))
    ours, theirs = (env.step(td.set(K.ACTION, action))["next"] for td in (again, state))
    assert_same_state(ours.select(*keys, "reward"), theirs.select(*keys, "reward"))


def test_what_a_given_state_leaves_open_follows_from_it():
    env, td = env_for(FEW, lidar_range=1.5)
    cells = torch.where(td[K.TREES], int(F.Cell.OCCUPIED), int(F.Cell.FREE)).to(torch.uint8)
    given = TensorDict({K.TREES: td[K.TREES], K.POSITION: torch.tensor([2, 2]), K.CELLS: cells})
    found = env.reset(given, set_state=True)
    assert torch.equal(found[K.CELLS], cells) and found[K.COVERAGE].item() == 1.0
    assert found[K.TRAVERSABLE].sum() == 11 and found["step_count"].item() == 0


def test_a_partial_reset_restores_the_chosen_arenas_only():
    env = make_forest(num_envs=3)
    before = env.reset()
    other = make_forest(num_envs=3, seed=9).reset()
    mask = torch.tensor([[True], [False], [True]])
    td = env.reset(
        before.clone().update(other.select(K.TREES, K.POSITION, K.CELLS)).set("_reset", mask),
        set_state=True,
    )
    assert torch.equal(td[K.TREES][[0, 2]], other[K.TREES][[0, 2]])
    assert torch.equal(td[K.CELLS][[0, 2]], other[K.CELLS][[0, 2]])


def test_without_set_state_a_reset_draws():
    env = make_forest(num_envs=3)
    td = env.reset()
    assert not torch.equal(env.reset(td.clone(), set_state=False)[K.TREES], td[K.TREES])


def test_a_state_without_an_arena_is_refused():
    env = make_forest()
    with pytest.raises(ValueError, match='needs \\("arena", "trees"\\)'):
        env.reset(TensorDict({K.POSITION: torch.tensor([0, 0])}), set_state=True)


@pytest.mark.parametrize("make", [make_forest, make_transformed])
def test_an_unknown_option_of_a_reset_is_refused(make):
    with pytest.raises(TypeError, match="no_such_option"):
        make().reset(no_such_option=1)


@pytest.mark.parametrize("make", [make_forest, make_transformed])
@pytest.mark.parametrize("action", [-1, 9, -9])
def test_an_action_that_is_none_is_refused(make, action):
    env = make(num_envs=2)
    td = env.reset().set(K.ACTION, torch.tensor([0, action]))
    with pytest.raises(ValueError, match=f"action={action} is not allowed: it must be 0 to 8"):
        env.step(td)


# Composition.


def eventful(order):
    env = TransformedEnv(
        make_forest(num_envs=6, n_trees=16, lidar_range=2.5), Compose(*[t() for t in order])
    )
    torch.manual_seed(0)
    return env.rollout(30, break_when_any_done=False)["next"]


def test_the_order_of_the_transforms_does_not_matter():
    first = eventful(ORDERS[0])
    assert first[K.INTERVENED].any() and (first["reward"][first[K.INTERVENED]] == -5).all()
    for order in ORDERS[1:]:
        assert_same_state(eventful(order), first)


def test_a_filter_inside_the_workers_counts_for_a_reward_outside():
    def worker():
        return TransformedEnv(make_forest(n_trees=16, lidar_range=2.5), SafetyFilter())

    env = TransformedEnv(SerialEnv(3, worker), FrontierPotentialReward())
    torch.manual_seed(0)
    state = env.rollout(30, break_when_any_done=False)["next"]
    assert state[K.INTERVENED].any() and (state["reward"][state[K.INTERVENED]] == -5).all()
    env.close()


def test_a_filter_outside_a_reward_in_the_workers_is_refused():
    """The reward could not know what is replaced."""

    def worker():
        return TransformedEnv(make_forest(), FrontierPotentialReward())

    env = SerialEnv(2, worker)
    with pytest.raises(ValueError, match=r"FrontierPotentialReward inside .* SafetyFilter outside"):
        TransformedEnv(env, SafetyFilter()).reset()
    env.close()


@pytest.mark.parametrize("lidar_range", [2.5, 8.0])
def test_transforms_ask_the_env_for_what_it_knows(lidar_range):
    env = make_transformed(num_envs=2, lidar_range=lidar_range, coverage_goal=0.4)
    steps = env.rollout(20, break_when_any_done=False)
    graph = F.exploration_graph(
        steps[K.CELLS], steps[K.POSITION], window=7, max_frontiers=24, lidar_range=lidar_range
    )
    torch.testing.assert_close(steps[K.LENGTH], graph.length, rtol=0, atol=1e-6)
    after = steps["next"]
    goal = after["terminated"] & ~after[K.INTERVENED]
    assert goal.any() and (after["reward"][goal] == 100).all()


def test_the_reward_counts_in_the_window_of_the_graph():
    chain = [ExplorationGraph(window=3), FrontierPotentialReward()]
    for window, transforms in ((3, chain), (3, chain[::-1]), (7, [FrontierPotentialReward()])):
        env = TransformedEnv(make_forest(), Compose(*[t.clone() for t in transforms]))
        td = env.reset()
        expected = F.potential(td[K.CELLS], td[K.POSITION], window=window, beta=0.5)
        torch.testing.assert_close(td[K.POTENTIAL], expected)


def test_an_observation_alone_says_what_it_lacks():
    td = make_forest().reset().select(K.CELLS, K.POSITION)
    with pytest.raises(ValueError, match="ExplorationGraph is in no env to take its lidar_range"):
        ExplorationGraph()(td)
    assert ExplorationGraph(lidar_range=5.0)(td)[K.NODES].shape == (9 + 256, 8)


# Seeds and workers.


def test_workers_without_a_seed_have_forests_of_their_own():
    env = SerialEnv(3, make_unseeded)
    assert differ(env.reset()[K.TREES])
    env.close()


def test_a_seed_for_all_workers_differs_between_them_and_repeats():
    env = SerialEnv(3, make_unseeded)
    env.set_seed(5)
    first = env.reset()[K.TREES]
    env.set_seed(5)
    assert differ(first) and torch.equal(env.reset()[K.TREES], first)
    env.close()


@pytest.mark.parametrize("make", [make_forest, make_transformed])
def test_the_same_seed_gives_the_same_episode(make):
    def episode(env, seed):
        env.set_seed(seed)
        torch.manual_seed(0)
        return env.rollout(12, break_when_any_done=False)

    env = make(num_envs=3)
    first = episode(env, 4)
    assert_same_state(episode(env, 4), first)
    assert not torch.equal(episode(env, 5)[K.TREES], first[K.TREES])


@pytest.mark.slow
@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_workers_may_be_processes_whatever_the_parent_did_before(start):
    make_unseeded().rollout(3)  # compiled code has run in the parent
    env = ParallelEnv(2, make_unseeded, mp_start_method=start)
    steps = env.rollout(4, break_when_any_done=False)
    assert steps.batch_size == (2, 3, 4) and differ(steps[:, :, 0][K.TREES])
    env.close()


@pytest.mark.slow
def test_the_workers_of_a_collector_have_forests_of_their_own():
    collector = MultiSyncCollector(
        [make_unseeded, make_unseeded], None, frames_per_batch=24, total_frames=24
    )
    (batch,) = list(collector)
    assert differ(batch[K.TREES].reshape(2, 3, -1, 9, 9)[:, :, 0])


# Estimators.


@pytest.mark.parametrize("kernel", ["fused", "pyg"])
def test_gae_takes_the_critic_as_in_torchrls_tutorials(kernel):
    torch.manual_seed(0)
    networks = GATv2ActorCritic(kernel=kernel)
    env = make_transformed(num_envs=2)
    with set_exploration_type(ExplorationType.RANDOM), torch.no_grad():
        batch = env.rollout(6, networks.make_actor(), break_when_any_done=False)
    gae = GAE(gamma=0.99, lmbda=0.95, value_network=networks.make_critic())
    plain = GAE(gamma=0.99, lmbda=0.95, value_network=networks.make_critic(), deactivate_vmap=True)
    with torch.no_grad():
        ours, theirs = gae(batch.clone()), plain(batch.clone())
    torch.testing.assert_close(ours["advantage"], theirs["advantage"], rtol=0, atol=1e-5)
