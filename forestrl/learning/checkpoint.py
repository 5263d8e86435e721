"""Exact saves: a training that stopped goes on as if it had not.

A checkpoint folder holds the policy file and ``training.pt``: the optimiser, all sources of
randomness, and the state of every arena.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import torch
from tensordict import TensorDict
from torchrl.collectors import Collector

from forestrl import keys as K
from forestrl.learning.ppo import PPO
from forestrl.storage import atomic_write

TRAINING_FILE = "training.pt"


def training_state(ppo: PPO, collector: Collector, progress: dict[str, Any]) -> dict[str, Any]:
    """Gathers everything the next update depends on.

    Args:
        ppo: gives networks and optimiser.
        collector: gives the arenas as they stand, and the env's generator.
        progress: counters and scores of the caller.
    """
    return {
        "actor": ppo.actor.state_dict(),
        "critic": ppo.critic.state_dict(),
        "optimizer": ppo.optimizer.state_dict(),
        "rng": torch.get_rng_state(),
        "env_rng": collector.env.base_env.rng.get_state(),
        "arenas": dict(collector._carrier.flatten_keys("/").items()),
        "frames": collector._frames,
        "progress": progress,
    }


def restore_training(state: dict[str, Any], ppo: PPO, collector: Collector) -> dict[str, Any]:
    """Puts a training back to where :func:`training_state` found it; returns ``progress``.

    Raises:
        ValueError: if the networks or the number or size of the arenas are not the same.
    """
    try:
        ppo.actor.load_state_dict(state["actor"])
        ppo.critic.load_state_dict(state["critic"])
        arenas = TensorDict(state["arenas"], collector.env.batch_size).unflatten_keys("/")
    except RuntimeError as error:
        raise ValueError(f"the training to go on with had other settings: {error}") from error
    before, now = arenas[K.TREES].shape, collector._carrier[K.TREES].shape
    if before != now:
        raise ValueError(
            f"the training to go on with had arenas {list(before)}, these are {list(now)}: leave "
            "env.size and env.num_envs as they were"
        )
    rates = [group["lr"] for group in ppo.optimizer.param_groups]  # may have been asked for anew
    ppo.optimizer.load_state_dict(state["optimizer"])
    for group, rate in zip(ppo.optimizer.param_groups, rates, strict=True):
        group["lr"] = rate
    torch.set_rng_state(state["rng"])
    collector.env.base_env.rng.set_state(state["env_rng"])
    collector._carrier.update(arenas)
    collector._frames = state["frames"]
    return state["progress"]


def save_training(folder: Path, state: dict[str, Any]) -> None:
    """Writes ``training.pt``, whole or not at all."""
    buffer = io.BytesIO()
    torch.save(state, buffer)
    atomic_write(folder / TRAINING_FILE, buffer.getvalue())


def load_training(folder: Path) -> dict[str, Any]:
    """Reads ``training.pt``.

    Raises:
        FileNotFoundError: if the folder has none.
        ValueError: if the file is damaged.
    """
    path = folder / TRAINING_FILE
    if not path.is_file():
        raise FileNotFoundError(f"resume={folder} holds no {TRAINING_FILE}: give a run folder")
    try:
        return torch.load(path, weights_only=True)
    except Exception as error:
        raise ValueError(f"{path} is damaged and cannot be resumed from: {error}") from error
