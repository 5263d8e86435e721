"""Envs and the collector from the configuration; the order of the transforms."""

from __future__ import annotations

import inspect
import re
from typing import Any

from hydra.utils import get_class, instantiate
from omegaconf import DictConfig, OmegaConf
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import Compose, EnvBase, RewardSum, Transform, TransformedEnv

from forestrl.build.errors import ConfigError
from forestrl.build.names import name_of, settings_of
from forestrl.envs import OBSERVATIONS, StaggeredEpisodes
from forestrl.learning.collector import ArenaCollector
from forestrl.policies.files import CheckpointError, Described


def make_forest(cfg: DictConfig, num_envs: int | None = None) -> EnvBase:
    """Builds the bare env.

    Args:
        cfg: the whole configuration. ``env`` holds the env's arguments and, beside them, the names
            that its ``world`` refers to, such as ``env.size``.
        num_envs: arenas stepped at once; by default the configuration's.
    """
    raw: Any = OmegaConf.to_container(cfg.env, resolve=False)
    node: Any = OmegaConf.to_container(cfg.env, resolve=True)
    arguments = inspect.signature(get_class(node["_target_"])).parameters
    referred = set(re.findall(r"\$\{env\.(\w+)\}", str(raw.get("world")))) - arguments.keys()
    settings = {name: value for name, value in node.items() if name not in referred}
    return instantiate(settings | {"num_envs": num_envs or cfg.env.num_envs})


def make_env(cfg: DictConfig, num_envs: int | None = None, policy: object = None) -> TransformedEnv:
    """Builds the env as evaluation sees it: forest, filter and observation.

    Args:
        cfg: the whole configuration.
        num_envs: arenas stepped at once; by default the configuration's.
        policy: one out of a file brings its own observation; for others, it is the configuration's.
    """
    file = getattr(policy, "file", None)
    observe = make_observation(cfg, None if file is None else file.observation)
    return TransformedEnv(make_forest(cfg, num_envs), Compose(*_chosen(cfg.safety), observe))


def make_training_env(cfg: DictConfig) -> TransformedEnv:
    """Builds the env as training sees it: filter, observation, reward, and staggered episodes."""
    env = make_env(cfg)
    for transform in (*_chosen(cfg.reward), StaggeredEpisodes(cfg.episode_steps), RewardSum()):
        env.append_transform(transform)
    return env


def make_observation(cfg: DictConfig, described: Described | None = None) -> Transform:
    """Builds an observation: the configuration's, or the one that a policy reads.

    Raises:
        CheckpointError: if the policy's is neither a known one nor the configuration's.
    """
    if described is None:
        return instantiate(cfg.graph)
    classes = {**OBSERVATIONS, name_of(cfg.graph, OBSERVATIONS): get_class(cfg.graph["_target_"])}
    if described.name not in classes:
        raise CheckpointError(
            f"the policy reads {described.name!r}, which is not one of {', '.join(classes)}: give "
            "its configuration with --config-dir and graph=, as in its training"
        )
    same = described.name == name_of(cfg.graph, OBSERVATIONS)
    own = settings_of(cfg.graph) if same else {}
    return classes[described.name](**{**own, **described.settings})


def _chosen(node: DictConfig) -> list[Any]:
    """What a node builds, if it is not left out."""
    return [] if node.get("_target_") is None else [instantiate(node)]


def make_collector(
    cfg: DictConfig, env: TransformedEnv, actor: TensorDictModuleBase
) -> ArenaCollector:
    """Builds the collector: endless batches of ``frames_per_batch`` frames over all arenas."""
    frames, arenas = cfg.algo.frames_per_batch, cfg.env.num_envs
    if frames % arenas:
        raise ConfigError(
            f"env.num_envs={arenas} is not allowed: it must divide algo.frames_per_batch={frames}"
        )
    return ArenaCollector(env, actor, frames)
