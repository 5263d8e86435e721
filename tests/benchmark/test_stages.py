"""The stages: what each of them runs."""

import pytest
import torch

from forestrl import keys as K
from forestrl.benchmark.stages import decisions, learning_stages, steps
from forestrl.benchmark.states import arrange, enter, explore
from forestrl.envs import ExplorationGraph, FrontierPotentialReward, SafetyFilter
from forestrl.jobs.bench import make_setup, resized
from tests.commands import compose

FRAMES, EPOCHS = 24, 2
OVERRIDES = [
    f"algo.frames_per_batch={FRAMES}",
    "algo.num_minibatches=3",
    f"algo.num_epochs={EPOCHS}",
    "episode_steps=50",
]


def setup_of(num_envs):
    return make_setup(resized(compose("bench", *OVERRIDES), 16, num_envs))


@pytest.fixture(scope="module")
def setup():
    return setup_of(4)


@pytest.fixture(scope="module")
def worlds(setup):
    return explore(setup.training.base_env, steps=50)


def test_each_env_has_one_transform_more_than_the_one_before(setup):
    kinds = [SafetyFilter, ExplorationGraph, FrontierPotentialReward]
    forest, *transformed = setup.envs().values()
    assert forest is setup.training.base_env
    for count, env in enumerate(transformed, 1):
        assert [type(transform) for transform in env.transform] == kinds[:count]


def test_the_last_env_steps_as_in_training(setup, worlds):
    env = setup.envs()["+ reward"]
    state = enter(env, worlds)
    ours, theirs = env.step(state), setup.training.step(enter(setup.training, worlds))
    for key in ("reward", K.CELLS, K.EXECUTED, *K.GRAPH):
        assert torch.equal(ours["next", key], theirs["next", key]), key


def test_trunks_keep_their_proportion_to_the_area():
    cfg = compose("bench")
    assert (cfg.env.size, cfg.env.n_trees) == (50, 45)
    changed = resized(cfg, 100, 7, room=300)
    assert (changed.env.size, changed.env.n_trees, changed.env.num_envs) == (100, 180, 7)
    assert resized(cfg, (25, 50), 1).env.n_trees == round(45 / 2)
    assert changed.graph.max_frontiers == 300
    assert resized(cfg, 100, 7).graph.max_frontiers == cfg.graph.max_frontiers == 256


def test_a_step_is_worth_a_frame_for_every_arena(setup, worlds):
    for stage in steps(setup, arrange(worlds, 4)):
        assert stage.frames == 4
        stage.call()


def test_minibatches_learn_and_are_worth_their_share_of_the_epochs(setup, worlds):
    before = [parameter.clone() for parameter in setup.networks.parameters()]
    frames = {}
    for stage in learning_stages(setup, worlds):
        frames[stage.name] = stage.frames
        if stage.name == "PPO minibatches":
            stage.call()
    assert frames == {
        "GAE": FRAMES,
        "PPO minibatches": FRAMES / 3 / EPOCHS,
        "train iteration": FRAMES,
    }
    assert any(
        not torch.equal(parameter, old)
        for parameter, old in zip(setup.networks.parameters(), before, strict=True)
    )


def test_arenas_that_divide_no_batch_have_no_learning_stages(worlds):
    assert list(learning_stages(setup_of(5), worlds)) == []


def test_decisions_are_those_of_the_network_behind_the_filter(worlds):
    alone = setup_of(1)
    free, safe, from_map = decisions(alone, arrange(worlds, 1))
    env = alone.envs()["+ graph"]
    for world in arrange(worlds, 1):
        state = enter(env, world)[0]
        with torch.no_grad():
            action = alone.networks.actor(*(state[key] for key in K.GRAPH)).argmax(-1)
        assert torch.equal(free.call(), action)
        found, decision = safe.call(), from_map.call()
        assert state[K.FEASIBLE][found] and state[K.FEASIBLE][decision.action]
        assert found == action or not state[K.FEASIBLE][action]
