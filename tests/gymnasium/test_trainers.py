"""Other libraries train on the Gymnasium environment: their checkers, and the examples."""

import runpy
import warnings
from pathlib import Path

import gymnasium
import pytest
import torch

import forestrl.gymnasium

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STEPS = 2048


def trained(name, steps, folder, monkeypatch):
    """The weights after a training of an example."""
    monkeypatch.chdir(folder)
    agent = runpy.run_path(str(EXAMPLES / f"{name}.py"))["train"](steps)
    return [p.detach().clone() for p in agent.policy.parameters()]


def test_stable_baselines3s_checker_has_nothing_to_say():
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    env = gymnasium.make(forestrl.gymnasium.ID, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(env.unwrapped)


def test_every_example_is_run():
    names = {path.stem for path in EXAMPLES.glob("*_ppo.py")}
    assert names == {"stable_baselines3_ppo", "maskable_ppo"}


@pytest.mark.slow
@pytest.mark.heavy
@pytest.mark.parametrize(
    ("name", "library"),
    [
        ("stable_baselines3_ppo", "stable_baselines3"),
        ("maskable_ppo", "sb3_contrib"),
    ],
)
def test_an_example_trains(name, library, tmp_path, monkeypatch):
    """The weights move away from those that the same seed starts with, and stay finite."""
    pytest.importorskip(library)
    before, after = (trained(name, steps, tmp_path, monkeypatch) for steps in (0, STEPS))
    assert all(weight.isfinite().all() for weight in after)
    assert not any(map(torch.equal, before, after))


@pytest.mark.slow
@pytest.mark.heavy
def test_maskable_ppo_without_a_filter_never_collides(tmp_path, monkeypatch):
    """The masks hold what the filter would have held."""
    pytest.importorskip("sb3_contrib")
    monkeypatch.chdir(tmp_path)
    example = runpy.run_path(str(EXAMPLES / "maskable_ppo.py"))
    model, env = example["train"](STEPS // 2), example["make"]()
    observation, _ = env.reset(seed=1)
    for _ in range(200):
        action, _ = model.predict(observation, action_masks=env.unwrapped.action_masks())
        observation, _, terminated, truncated, info = env.step(action)
        assert not info["collision"]
        if terminated or truncated:
            observation, _ = env.reset()
