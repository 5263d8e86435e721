"""Trains sb3-contrib's MaskablePPO, which takes feasible actions only, without the safety filter.

The env's ``action_masks`` tell which these are: ``python examples/maskable_ppo.py``.
"""

import gymnasium
from sb3_contrib import MaskablePPO
from stable_baselines3.common.env_util import make_vec_env

import forestrl.gymnasium
from forestrl.envs import RandomForest


def make() -> gymnasium.Env:
    """One env: small forests without a filter, and a graph of a size for them."""
    return gymnasium.make(
        forestrl.gymnasium.ID,
        world=RandomForest(20, n_trees=6),
        safety=False,
        graph={"max_frontiers": 64},
        max_steps=300,
    )


def train(steps: int = 200_000) -> MaskablePPO:
    """Trains in four envs at once."""
    env = make_vec_env(make, n_envs=4, seed=0)
    model = MaskablePPO("MultiInputPolicy", env, n_steps=256, gamma=0.99, seed=0, device="cpu")
    return model.learn(steps)


if __name__ == "__main__":
    train().save("maskable_ppo")
