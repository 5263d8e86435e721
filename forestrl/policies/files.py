"""Policy files: the weights of both networks with what is needed to build them, and no pickle.

A policy file is a safetensors file; its header holds the architecture, the observation it reads
and how it was trained, as JSON.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from forestrl.policies.actor_critic import ActorCritic, Kernel
from forestrl.storage import atomic_write

FORMAT = "forestrl-policy-1"
ASSETS = Path(__file__).parent / "assets"
RELEASED = ASSETS / "paper.safetensors"
"""The released policy, used where no checkpoint is given."""

POLICY_FILE = "policy.safetensors"
_WHERE_SILENT = {"edge_lengths": True}  # what older files do not say
_IN_A_RUN = ("checkpoints/best", "checkpoints/latest", "")


class CheckpointError(ValueError):
    """A checkpoint that is missing, damaged, or made for something else."""


@dataclass(frozen=True)
class Policy:
    """A policy file in memory.

    Attributes:
        model: keyword arguments of :class:`ActorCritic`, ``kernel`` left out.
        window: ``k``, the side of the local window its observation was made with.
        training: how it was trained: frames, seed and what else the writer wrote down.
        weights: the state dict of the :class:`ActorCritic`.
    """

    model: dict[str, Any]
    window: int
    training: dict[str, Any]
    weights: dict[str, torch.Tensor]

    def build(self, kernel: Kernel = "fused", lidar_range: float | None = None) -> ActorCritic:
        """Builds the networks with these weights.

        Args:
            kernel: what computes them.
            lidar_range: ``l``, the unit of edge lengths, cells; by default that of the training.

        Raises:
            CheckpointError: if they do not fit the model.
        """
        unit = {} if lidar_range is None else {"lidar_range": lidar_range}
        networks = ActorCritic(**{**self.model, **unit}, kernel=kernel)
        try:
            networks.load_state_dict(self.weights)
        except RuntimeError as error:
            raise CheckpointError(f"the policy's weights do not fit its model: {error}") from error
        return networks.eval().requires_grad_(False)


def save_policy(path: Path, policy: Policy) -> None:
    """Writes a policy file, whole or not at all."""
    header = {
        "format": FORMAT,
        "model": json.dumps(policy.model),
        "window": json.dumps(policy.window),
        "training": json.dumps(policy.training),
    }
    weights = {name: value.detach().contiguous().cpu() for name, value in policy.weights.items()}
    atomic_write(path, save(weights, metadata=header))


def load_policy(path: str | Path) -> Policy:
    """Reads a policy file.

    Args:
        path: the file, or a run folder (its best checkpoint, else its latest).

    Raises:
        CheckpointError: if there is none, or it cannot be read; the message says why.
    """
    path = find_policy(Path(path))
    try:
        with safe_open(path, framework="pt") as file:
            header = file.metadata() or {}
            weights = {name: file.get_tensor(name) for name in file.keys()}
    except (SafetensorError, OSError) as error:
        raise CheckpointError(f"checkpoint={path} cannot be read as a policy: {error}") from error
    if header.get("format") != FORMAT:
        raise CheckpointError(
            f"checkpoint={path} is a safetensors file but not a policy of this program: its "
            f"format is {header.get('format')!r}, not {FORMAT!r}"
        )
    try:
        parts = {name: json.loads(header[name]) for name in ("model", "window", "training")}
    except (KeyError, json.JSONDecodeError) as error:
        raise CheckpointError(
            f"checkpoint={path} cannot be read as a policy: its header is damaged: {error}"
        ) from error
    return Policy(**parts, weights=weights)


def find_policy(path: Path) -> Path:
    """Finds the policy file that a path means: the file itself, or the one in a run folder."""
    if path.is_file():
        return path
    if not path.exists():
        raise CheckpointError(
            f"checkpoint={path} does not exist: give a run folder or a policy file"
        )
    for folder in _IN_A_RUN:
        if (path / folder / POLICY_FILE).is_file():
            return path / folder / POLICY_FILE
    raise CheckpointError(
        f"checkpoint={path} is a folder without a policy: expected {_IN_A_RUN[0]}/{POLICY_FILE} in "
        "it, as a training leaves it"
    )


def require_same(policy: Policy, wanted: Mapping[str, Any], source: str) -> None:
    """Refuses a policy made for another model.

    Args:
        policy: the policy.
        wanted: the fields asked for, by name: those of ``Policy.model`` and ``window``.
        source: how to call the policy in the message.

    Raises:
        CheckpointError: naming the first field that differs and both values.
    """
    made_for = {**_WHERE_SILENT, **policy.model, "window": policy.window}
    for name, value in wanted.items():
        if name in made_for and made_for[name] != value:
            raise CheckpointError(
                f"checkpoint={source} was made for another model: its {name} is "
                f"{made_for[name]}, but {name}={value} was asked for"
            )
