"""Exact saves: a training that stopped goes on as if it had not.

A checkpoint folder holds the policy file and ``training.pt``: the optimiser, all sources of
randomness, and the state of every arena, behind a checksum. The one before is kept beside it.
"""

from __future__ import annotations

import copy
import hashlib
import io
import sys
from pathlib import Path
from typing import Any

import torch

from forestrl.learning.collector import ArenaCollector
from forestrl.learning.ppo import PPO
from forestrl.storage import atomic_write

TRAINING_FILE, BEFORE_FILE = "training.pt", "training.before.pt"
_MARK = b"forestrl training 2\n"


def training_state(ppo: PPO, collector: ArenaCollector, progress: dict[str, Any]) -> dict[str, Any]:
    """Copies everything the next update depends on.

    Args:
        ppo: gives networks and optimiser.
        collector: gives the arenas as they stand, and the env's generator.
        progress: counters and scores of the caller.
    """
    state = {
        "actor": ppo.actor.state_dict(),
        "critic": ppo.critic.state_dict(),
        "optimizer": ppo.optimizer.state_dict(),
        "rng": torch.get_rng_state(),
        "cuda_rng": torch.cuda.get_rng_state_all() if torch.cuda.is_available() else [],
        "collector": collector.state,
        "progress": progress,
    }
    return copy.deepcopy(state)


def restore_training(state: dict[str, Any], ppo: PPO, collector: ArenaCollector) -> dict[str, Any]:
    """Puts a training back to where :func:`training_state` found it; returns ``progress``.

    Raises:
        ValueError: if the networks or the number or size of the arenas are not the same.
    """
    if "collector" not in state and "arenas" in state:  # of an older version
        names = {"arenas": "arenas", "frames": "frames", "env_rng": "generator"}
        state = state | {"collector": {new: state[old] for old, new in names.items()}}
    try:
        ppo.actor.load_state_dict(state["actor"])
        ppo.critic.load_state_dict(state["critic"])
        collector.state = state["collector"]
        rates = [group["lr"] for group in ppo.optimizer.param_groups]  # may be asked for anew
        ppo.optimizer.load_state_dict(state["optimizer"])
        for group, rate in zip(ppo.optimizer.param_groups, rates, strict=True):
            group["lr"] = rate
        torch.set_rng_state(state["rng"])
        if len(state.get("cuda_rng", [])) == torch.cuda.device_count() > 0:
            torch.cuda.set_rng_state_all(state["cuda_rng"])
        return state["progress"]
    except RuntimeError as error:
        raise ValueError(f"the training to go on with had other settings: {error}") from error
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"the checkpoint is not of a training like this one: {error!r}") from error


def save_training(folder: Path, state: dict[str, Any]) -> None:
    """Writes ``training.pt``, whole or not at all; the one before stays beside it."""
    buffer = io.BytesIO()
    torch.save(state, buffer)
    data = buffer.getvalue()
    checksum = hashlib.sha256(data).hexdigest().encode()
    content = _MARK + checksum + b"\n" + data
    atomic_write(folder / TRAINING_FILE, content, before=folder / BEFORE_FILE)


def load_training(folder: Path) -> dict[str, Any] | None:
    """Reads ``training.pt``; the one before, with a line that says so, if it is damaged.

    Returns:
        None if there is neither.

    Raises:
        ValueError: if the file is damaged and there is none before it, or that is damaged too.
    """
    damage: ValueError | None = None
    for path in (folder / TRAINING_FILE, folder / BEFORE_FILE):
        if not path.is_file():
            continue
        try:
            state = _read(path)
        except ValueError as error:
            damage = damage or error
            continue
        if damage:
            print(f"{damage}; going on from the one before, {path.name}", file=sys.stderr)
            (folder / TRAINING_FILE).unlink()  # or it would be kept as the next one before
        return state
    if damage:
        raise damage
    return None


def _read(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    if data.startswith(_MARK):  # older files have no checksum
        checksum, _, data = data.removeprefix(_MARK).partition(b"\n")
        if hashlib.sha256(data).hexdigest().encode() != checksum:
            raise ValueError(f"{path} is damaged: its checksum is not that of its content")
    try:
        return torch.load(io.BytesIO(data), weights_only=True)
    except Exception as error:
        raise ValueError(f"{path} is damaged, and cannot be resumed from") from error
