"""Configuration to objects: the only assembler. It reads the configuration and never writes it."""

from forestrl.build.envs import (
    make_collector,
    make_env,
    make_forest,
    make_observation,
    make_training_env,
)
from forestrl.build.errors import ConfigError
from forestrl.build.logging import make_logger
from forestrl.build.machine import prepare
from forestrl.build.networks import check_model, make_networks, make_ppo, to_policy
from forestrl.build.policies import as_trained, make_policy

__all__ = [
    "ConfigError",
    "as_trained",
    "check_model",
    "make_collector",
    "make_env",
    "make_forest",
    "make_logger",
    "make_networks",
    "make_observation",
    "make_policy",
    "make_ppo",
    "make_training_env",
    "prepare",
    "to_policy",
]
