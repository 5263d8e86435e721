"""The GATv2 policy bound to its keys."""

import pytest
import torch

from forestrl import keys as K
from forestrl.policies.actor_critic import ActorCritic
from forestrl.policies.gatv2 import GATv2ActorCritic
from tests.envs.worlds import make_transformed


@pytest.fixture
def networks():
    torch.manual_seed(0)
    networks = GATv2ActorCritic()
    with torch.no_grad():
        networks.actor.conv2.lin_l.weight.mul_(100)  # make the logits differ
    return networks


@pytest.fixture
def state():
    return make_transformed(num_envs=1).reset()


def sampled(networks, state, uniform):
    many = state.expand(len(uniform)).clone()
    return networks.make_policy()(many.set(K.UNIFORM, uniform))[K.ACTION]


@torch.no_grad()
def test_actions_are_sampled_by_the_inverse_of_their_distribution(networks, state):
    """A regular grid of draws gives every action as often as its probability says."""
    draws = 5000
    actions = sampled(networks, state, (torch.arange(draws) + 0.5) / draws)
    probability = networks.actor(*(state[key] for key in K.GRAPH)).softmax(-1).squeeze(0)
    assert probability.max() - probability.min() > 0.1
    share = torch.bincount(actions, minlength=9) / draws
    torch.testing.assert_close(share, probability, atol=2 / draws, rtol=0)
    assert (actions.diff() >= 0).all()


@torch.no_grad()
def test_the_same_draw_gives_the_same_action(networks, state):
    uniform = torch.rand(64)
    assert sampled(networks, state, uniform).equal(sampled(networks, state, uniform))
    edges = sampled(networks, state, torch.tensor([0.0, 1 - 2**-24]))
    assert edges.min() >= 0 and edges.max() <= 8


@torch.no_grad()
def test_deterministic_takes_the_most_probable_action_and_needs_no_draw(networks):
    state = make_transformed(num_envs=5).reset()
    after = networks.make_policy(deterministic=True)(state)
    assert after[K.ACTION].equal(after[K.LOGITS].argmax(-1))
    assert after[K.LOGITS].equal(networks.actor(*(state[key] for key in K.GRAPH)))


@torch.no_grad()
def test_actor_and_policy_share_their_network(networks, state):
    actor, policy = networks.make_actor(), networks.make_policy()
    state[K.UNIFORM] = torch.tensor([0.5])
    before = policy(state.clone())[K.LOGITS]
    assert actor(state.clone())[K.LOGITS].equal(before)
    networks.actor.conv2.bias.add_(1.0)
    assert policy(state.clone())[K.LOGITS].equal(actor(state.clone())[K.LOGITS])
    assert not policy(state.clone())[K.LOGITS].equal(before)


@torch.no_grad()
def test_actor_writes_the_log_probability_of_its_action(networks, state):
    after = networks.make_actor()(state)
    expected = after[K.LOGITS].log_softmax(-1).gather(-1, after[K.ACTION].unsqueeze(-1))
    torch.testing.assert_close(after["action_log_prob"], expected.squeeze(-1))


@torch.no_grad()
@pytest.mark.parametrize("readout", ["mean", "concat"])
def test_critic_has_weights_of_its_own(readout, state):
    networks = GATv2ActorCritic(critic_readout=readout)
    before = networks.make_actor()(state.clone())[K.LOGITS]
    assert networks.make_critic()(state)["state_value"].shape == (1, 1)
    for weight in networks.critic.parameters():
        weight.zero_()
    assert networks.make_critic()(state)["state_value"].item() == 0
    assert networks.make_actor()(state)[K.LOGITS].equal(before)


def test_table_2_shapes():
    actor = GATv2ActorCritic().actor
    assert actor.conv1.lin_l.weight.shape == (4 * 16, 8)
    assert actor.conv2.lin_l.weight.shape == (1, 64)


def test_a_network_that_names_no_keys_is_refused():
    with pytest.raises(ValueError, match="Linear does not say what it reads: give it in_keys"):
        ActorCritic(torch.nn.Linear(1, 1), torch.nn.Linear(1, 1))


@torch.no_grad()
@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30])
def test_a_policy_with_broken_weights_says_so(networks, state, value):
    networks.actor.conv2.bias.fill_(float("nan") if value == 1e30 else value)
    with pytest.raises(ValueError, match="not finite: its weights are broken"):
        networks.make_policy()(state)


def test_a_policy_draws_for_itself_in_a_rollout(networks):
    """As a user of TorchRL would try it, without evaluation's own draws."""
    env = make_transformed(num_envs=3)
    torch.manual_seed(1)
    first = env.rollout(12, networks.make_policy(), break_when_any_done=False)
    env.set_seed(0)
    torch.manual_seed(1)
    again = env.rollout(12, networks.make_policy(), break_when_any_done=False)
    assert len(first[K.ACTION].unique()) > 2
    assert first[K.ACTION].shape == again[K.ACTION].shape == (3, 12)


@pytest.mark.parametrize("name", ["kernel", "critic_readout"])
def test_an_unknown_choice_is_refused(name):
    with pytest.raises(ValueError, match=rf"{name}=other is not allowed: it must be \w+ or \w+"):
        GATv2ActorCritic(**{name: "other"})
