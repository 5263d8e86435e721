"""Trains skrl's PPO on small forests: ``python examples/skrl_ppo.py``."""

import gymnasium
from gymnasium.wrappers import FlattenObservation
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from skrl.utils.model_instantiators.torch import categorical_model, deterministic_model

import forestrl.gymnasium
from forestrl.envs import RandomForest

ENVS, ROLLOUT = 4, 256
LAYERS = [{"name": "net", "input": "OBSERVATIONS", "layers": [64, 64], "activations": "tanh"}]


def make() -> gymnasium.vector.VectorEnv:
    """Four envs: small forests, and graphs of a size for them, each as one vector."""
    return gymnasium.make_vec(
        forestrl.gymnasium.ID,
        ENVS,
        wrappers=[FlattenObservation],
        world=RandomForest(20, n_trees=6),
        graph={"max_frontiers": 64},
        max_steps=300,
    )


def train(steps: int = 200_000) -> PPO:
    """Trains in four envs at once."""
    set_seed(0)
    env = wrap_env(make())
    spaces = {name: getattr(env, name) for name in ("observation_space", "action_space")}
    models = {
        "policy": categorical_model(**spaces, device="cpu", network=LAYERS, output="ACTIONS"),
        "value": deterministic_model(**spaces, device="cpu", network=LAYERS, output="ONE"),
    }
    agent = PPO(
        models=models,
        memory=RandomMemory(memory_size=ROLLOUT, num_envs=ENVS, device="cpu"),
        cfg=PPO_CFG(rollouts=ROLLOUT, mini_batches=16, learning_rate=3e-4),
        device="cpu",
        **spaces,
    )
    trainer = SequentialTrainer(env=env, agents=agent, cfg={"timesteps": steps // ENVS})
    trainer.train()
    return agent


if __name__ == "__main__":
    train().save("skrl_ppo.pt")
