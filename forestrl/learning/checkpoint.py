"""Exact saves: a training that stopped goes on as if it had not.

A checkpoint folder holds the policy file and ``training.pt``: the optimiser, all sources of
randomness, and the state of every arena, behind a checksum.
"""

from __future__ import annotations

import hashlib
import io
from pathlib import Path
from typing import Any

import torch

from forestrl.learning.collector import ArenaCollector
from forestrl.learning.ppo import PPO
from forestrl.storage import atomic_write

TRAINING_FILE = "training.pt"
_MARK = b"forestrl training 2\n"


def training_state(ppo: PPO, collector: ArenaCollector, progress: dict[str, Any]) -> dict[str, Any]:
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
        "cuda_rng": torch.cuda.get_rng_state_all() if torch.cuda.is_available() else [],
        "collector": collector.state,
        "progress": progress,
    }


def restore_training(state: dict[str, Any], ppo: PPO, collector: ArenaCollector) -> dict[str, Any]:
    """Puts a training back to where :func:`training_state` found it; returns ``progress``.

    Raises:
        ValueError: if the networks or the number or size of the arenas are not the same.
    """
    if "collector" not in state:  # of an older version
        names = {"arenas": "arenas", "frames": "frames", "env_rng": "generator"}
        state = state | {"collector": {new: state[old] for old, new in names.items()}}
    try:
        ppo.actor.load_state_dict(state["actor"])
        ppo.critic.load_state_dict(state["critic"])
    except RuntimeError as error:
        raise ValueError(f"the training to go on with had other settings: {error}") from error
    collector.state = state["collector"]
    rates = [group["lr"] for group in ppo.optimizer.param_groups]  # may have been asked for anew
    ppo.optimizer.load_state_dict(state["optimizer"])
    for group, rate in zip(ppo.optimizer.param_groups, rates, strict=True):
        group["lr"] = rate
    torch.set_rng_state(state["rng"])
    if len(state.get("cuda_rng", [])) == torch.cuda.device_count() > 0:
        torch.cuda.set_rng_state_all(state["cuda_rng"])
    return state["progress"]


def save_training(folder: Path, state: dict[str, Any]) -> None:
    """Writes ``training.pt``, whole or not at all."""
    buffer = io.BytesIO()
    torch.save(state, buffer)
    data = buffer.getvalue()
    checksum = hashlib.sha256(data).hexdigest().encode()
    atomic_write(folder / TRAINING_FILE, _MARK + checksum + b"\n" + data)


def load_training(folder: Path) -> dict[str, Any]:
    """Reads ``training.pt``.

    Raises:
        FileNotFoundError: if the folder has none.
        ValueError: if the file is damaged.
    """
    path = folder / TRAINING_FILE
    if not path.is_file():
        raise FileNotFoundError(f"resume={folder} holds no {TRAINING_FILE}: give a run folder")
    data = path.read_bytes()
    if data.startswith(_MARK):  # older files have no checksum
        checksum, _, data = data.removeprefix(_MARK).partition(b"\n")
        if hashlib.sha256(data).hexdigest().encode() != checksum:
            raise ValueError(f"{path} is damaged: its checksum is not that of its content")
    try:
        return torch.load(io.BytesIO(data), weights_only=True)
    except Exception as error:
        raise ValueError(f"{path} is damaged and cannot be resumed from: {error}") from error
