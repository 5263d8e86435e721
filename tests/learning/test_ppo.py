"""PPO against its formulas, and Table III."""

import copy
import math

import pytest
import torch
from omegaconf import OmegaConf
from torchrl.envs import TransformedEnv, set_exploration_type

from forestrl import keys as K
from forestrl.envs import StaggeredEpisodes
from forestrl.learning.ppo import PPO
from forestrl.policies.gatv2 import GATv2ActorCritic
from tests.commands import compose
from tests.envs.worlds import make_forest, paper_transforms

ARENAS, TIME = 2, 8
FRAMES = ARENAS * TIME
TABLE_3 = {
    "env.size": 50,
    "env.n_trees": 45,
    "env.tree_radius": [1.0, 3.0],
    "env.lidar_range": 5.0,
    "env.coverage_goal": 0.98,
    "env.max_steps": 2500,
    "reward.r_explored": 100.0,
    "reward.r_unsafe": -5.0,
    "algo.frames_per_batch": 1024,
    "algo.num_minibatches": 64,
    "algo.num_epochs": 8,
    "algo.lr": 3e-4,
    "algo.gamma": 0.99,
    "algo.clip_epsilon": 0.2,
    "total_frames": 400_000,
}


@pytest.fixture(scope="module")
def train_config():
    return compose("train")


@pytest.mark.parametrize(("name", "value"), TABLE_3.items())
def test_table_3(name, value, train_config):
    assert OmegaConf.select(train_config, name) == value


@pytest.fixture
def networks():
    torch.manual_seed(0)
    return GATv2ActorCritic()


def make_ppo(networks, **options):
    settings = {"frames_per_batch": FRAMES, "num_minibatches": 1, "num_epochs": 1} | options
    return PPO(networks.make_actor(), networks.make_critic(), **settings)


@pytest.fixture
def batch(networks):
    """Two arenas of eight steps, episodes cut after three; the second step of one reaches rho*."""
    env = TransformedEnv(make_forest(num_envs=ARENAS))
    for transform in (*paper_transforms(), StaggeredEpisodes(3)):
        env.append_transform(transform)
    with torch.no_grad(), set_exploration_type("random"):
        batch = env.rollout(TIME, networks.make_actor(), break_when_any_done=False)
    batch["next", "terminated"][0, 1] = batch["next", "done"][0, 1] = True
    return batch.contiguous()


def values(networks, batch):
    with torch.no_grad():
        return networks.make_critic()(batch.select(*K.GRAPH))["state_value"].squeeze(-1)


def gae(batch, value, next_value, gamma=0.99, lmbda=0.95):
    """The advantages of skrl 1.4's loop, a truncated episode bootstrapping from its last state."""
    after = {name: batch["next", name].squeeze(-1) for name in ("reward", "terminated", "done")}
    advantage = torch.zeros(ARENAS, TIME)
    for arena in range(ARENAS):
        following = 0.0
        for t in reversed(range(TIME)):
            alive = 0.0 if after["terminated"][arena, t] else 1.0
            goes_on = 0.0 if after["done"][arena, t] else 1.0
            target = after["reward"][arena, t] + gamma * alive * next_value[arena, t]
            following = target - value[arena, t] + gamma * lmbda * goes_on * following
            advantage[arena, t] = following
    return advantage


def test_advantage_is_that_of_the_loop_normalised_over_the_batch(networks, batch):
    assert batch["next", "truncated"].any() and not batch["next", "done"].all()
    value, next_value = values(networks, batch), values(networks, batch["next"])
    expected = gae(batch, value, next_value)
    make_ppo(networks).estimate_advantage(batch)
    torch.testing.assert_close(batch["value_target"].squeeze(-1), expected + value)
    normalised = (expected - expected.mean()) / expected.std()
    torch.testing.assert_close(batch["advantage"].squeeze(-1), normalised, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize(("gamma", "lmbda"), [(0.5, 0.25), (0, 0.95), (0.99, 0), (1e-9, 1), (1, 1)])
def test_gamma_and_lambda_are_used(gamma, lmbda, networks, batch):
    value, next_value = values(networks, batch), values(networks, batch["next"])
    expected = gae(batch, value, next_value, gamma=gamma, lmbda=lmbda)
    make_ppo(networks, gamma=gamma, gae_lambda=lmbda).estimate_advantage(batch)
    torch.testing.assert_close(batch["value_target"].squeeze(-1), expected + value)


def test_losses_equal_their_formulas(networks, batch):
    """One minibatch that is the whole batch, of a policy that differed: ratios are not 1."""
    old = batch["action_log_prob"] + torch.linspace(-0.5, 0.5, FRAMES).view(ARENAS, TIME)
    batch["action_log_prob"] = old
    with torch.no_grad():
        log_probs = networks.actor(*(batch[key] for key in K.GRAPH)).log_softmax(-1)
    new = log_probs.gather(-1, batch["action"].unsqueeze(-1)).squeeze(-1)
    metrics = make_ppo(networks, critic_coeff=0.5).update(batch)
    advantage, ratio = batch["advantage"].squeeze(-1), (new - old).exp()
    clipped = ratio.clamp(0.8, 1.2)
    entropy = -(log_probs.exp() * log_probs).sum(-1)
    squares = (batch["value_target"] - batch["state_value"]).square()
    expected = {
        "loss/objective": -torch.minimum(ratio * advantage, clipped * advantage).mean(),
        "loss/critic": 0.5 * squares.mean(),
        "loss/entropy": entropy.mean(),
        "ppo/kl_approx": (old - new).mean(),
        "ppo/clip_fraction": (ratio != clipped).float().mean(),
    }
    for name, value in expected.items():
        assert math.isclose(metrics[name], value, rel_tol=1e-4, abs_tol=1e-5), name
    assert 0 < metrics["ppo/clip_fraction"] < 1
    variance = 1 - (batch["value_target"] - batch["state_value"]).var() / (
        batch["value_target"].var()
    )
    assert math.isclose(metrics["ppo/explained_variance"], variance, rel_tol=1e-5)


def test_every_frame_is_used_once_an_epoch_and_in_another_order_in_the_next(networks, batch):
    batch[K.NODES][..., -1, -1] = torch.arange(FRAMES).view(ARENAS, TIME).float()  # in the padding
    seen = []
    ppo = make_ppo(networks, num_minibatches=4, num_epochs=3)
    networks.actor.register_forward_pre_hook(lambda _, graph: seen.append(graph[0][..., -1, -1]))
    ppo.update(batch)
    assert [len(minibatch) for minibatch in seen] == [4] * 12
    epochs = torch.cat(seen).view(3, FRAMES)
    assert all(epoch.sort().values.tolist() == list(range(FRAMES)) for epoch in epochs)
    assert len({tuple(epoch.tolist()) for epoch in epochs}) == 3


def test_a_second_batch_replaces_the_first(networks, batch):
    ppo = make_ppo(networks, num_minibatches=2)
    ppo.update(batch.clone())
    seen = []
    batch[K.NODES][..., -1, -1] = 7.0
    networks.actor.register_forward_pre_hook(lambda _, graph: seen.append(graph[0][..., -1, -1]))
    ppo.update(batch)
    assert torch.cat(seen).tolist() == [7.0] * FRAMES


@pytest.mark.parametrize(("minibatches", "epochs"), [(1, 1), (4, 3), (16, 2)])
def test_there_is_one_adam_step_a_minibatch(minibatches, epochs, networks, batch):
    ppo = make_ppo(networks, num_minibatches=minibatches, num_epochs=epochs)
    ppo.update(batch)
    steps = {int(state["step"]) for state in ppo.optimizer.state.values()}
    assert steps == {minibatches * epochs}


def test_gradient_norm_of_both_networks_together_is_bounded(networks, batch):
    for bound in (0.5, 1e9):
        ppo = make_ppo(networks, max_grad_norm=bound)
        before = ppo.update(batch.clone())["ppo/grad_norm"]
        after = torch.stack([weight.grad.norm() for weight in networks.parameters()]).norm()
        assert before > 0.5
        assert math.isclose(after, min(before, bound), rel_tol=1e-4)


def test_both_networks_learn(networks, batch):
    before = {name: weight.clone() for name, weight in networks.named_parameters()}
    make_ppo(networks, num_minibatches=4).update(batch)
    same = [name for name, weight in networks.named_parameters() if weight.equal(before[name])]
    assert not same


@pytest.mark.parametrize("minibatches", [3, 7, 32])
def test_minibatches_must_divide_the_batch(minibatches, networks):
    both = f"num_minibatches={minibatches} .* frames_per_batch={FRAMES}"
    with pytest.raises(ValueError, match=both):
        make_ppo(networks, num_minibatches=minibatches)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *((name, value) for name in ("lr", "clip_epsilon", "max_grad_norm") for value in (0, -1)),
        ("num_epochs", 0),
        ("num_minibatches", 0),
        ("num_minibatches", -1),
        ("frames_per_batch", 0),
        *((name, value) for name in ("gamma", "gae_lambda") for value in (-0.1, 1.1)),
    ],
)
def test_values_out_of_range_are_refused(name, value, networks):
    with pytest.raises(ValueError, match=f"{name}={value} is not allowed: it must be"):
        make_ppo(networks, **{name: value})


def test_a_critic_that_weighs_nothing_is_not_trained(networks, batch):
    before = copy.deepcopy(networks.state_dict())
    metrics = make_ppo(networks, critic_coeff=0).update(batch)
    after = networks.state_dict()
    changed = {name.split(".")[0] for name in after if not torch.equal(after[name], before[name])}
    assert metrics["loss/critic"] == 0 and changed == {"actor"}
