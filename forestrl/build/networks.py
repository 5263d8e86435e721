"""Networks and what teaches them, from the configuration; and their description for a file."""

from __future__ import annotations

from typing import Any

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from torch import nn
from torchrl.envs import TransformedEnv

from forestrl import functional as F
from forestrl.build.errors import ConfigError
from forestrl.build.names import name_of, settings_of
from forestrl.envs import OBSERVATIONS, WORLDS
from forestrl.learning.ppo import PPO
from forestrl.policies.actor_critic import ActorCritic, keys_of
from forestrl.policies.files import Described, Policy, policy_bytes
from forestrl.released import MODELS

NOT_OF_THE_TASK = frozenset({"_target_", "world", "num_envs", "seed", "device"})
"""Entries of the env's node that say nothing of what is to be solved."""


def make_networks(cfg: DictConfig) -> ActorCritic:
    """Builds actor and critic, freshly initialised.

    Raises:
        ConfigError: if the model is no :class:`ActorCritic`.
    """
    networks = instantiate(cfg.model)
    if not isinstance(networks, ActorCritic):
        raise ConfigError(
            f"model={name_of(cfg.model, MODELS)} is a {type(networks).__name__}: a model is an "
            "ActorCritic(actor, critic), see docs/extend.md"
        )
    return networks.to(cfg.device)


def make_ppo(cfg: DictConfig, networks: ActorCritic) -> PPO:
    """Builds what teaches the networks."""
    return instantiate(cfg.algo, networks.make_actor(), networks.make_critic())


def check_model(cfg: DictConfig, networks: ActorCritic, env: TransformedEnv) -> None:
    """Refuses networks that cannot read the env's observation or cannot be saved.

    Raises:
        ConfigError: saying what is missing, before any training.
    """
    state = env.fake_tensordict()
    for role, network, wanted in (
        ("actor", networks.actor, F.WAYPOINTS),
        ("critic", networks.critic, 1),
    ):
        keys = keys_of(network)
        missing = [key for key in keys if state.get(key, None) is None]
        if missing:
            raise ConfigError(f"the {role} reads {missing[0]}, which no observation here writes")
        with torch.no_grad():
            found = tuple(network(*[state.get(key) for key in keys]).shape)
        if found != (*env.batch_size, wanted):
            raise ConfigError(
                f"the {role} gives {list(found)} for {list(env.batch_size)} arenas: it must give "
                f"{[*env.batch_size, wanted]}"
            )
    try:
        policy_bytes(to_policy(cfg, networks, {}))
    except (TypeError, ValueError, RuntimeError) as error:
        raise ConfigError(f"the model cannot be saved: {error}") from error


def to_policy(
    cfg: DictConfig, networks: nn.Module, training: dict[str, Any], reads_graph: bool = True
) -> Policy:
    """Gives networks the description that their policy file needs.

    Args:
        cfg: the whole configuration.
        networks: to be described.
        training: how they were trained.
        reads_graph: whether they read the configuration's observation; else the map alone.
    """
    task: Any = OmegaConf.to_container(cfg.env, resolve=True)
    world = OmegaConf.create(task["world"])
    return Policy(
        Described(name_of(cfg.model, MODELS), settings_of(cfg.model, learnt=True)),
        Described(name_of(cfg.graph, OBSERVATIONS), settings_of(cfg.graph, learnt=True))
        if reads_graph
        else None,
        {
            **training,
            "env": {name: value for name, value in task.items() if name not in NOT_OF_THE_TASK},
            "world": {"name": name_of(world, WORLDS), "settings": settings_of(world)},
            "filter": cfg.safety.get("_target_") is not None,
        },
        networks.state_dict(),
    )
