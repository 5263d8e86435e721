"""Policy files: weights with what is needed to build their networks again, and no pickle.

A policy file is a safetensors file. Its header names the model and the observation it reads, with
their settings, and how it was trained, as JSON with a checksum of all. Names are looked up in a
closed list; nothing that a file says is ever imported. Equal policies have equal bytes.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn

from forestrl.storage import atomic_write

FORMAT = 2
"""Files of format 1 are read too."""
POLICY_FILE = "policy.safetensors"

_KEY, _OLD_FORMAT = "forestrl", "forestrl-policy-1"
_IN_A_RUN = ("checkpoints/best", "checkpoints/latest", "")


class CheckpointError(ValueError):
    """A checkpoint that is missing, damaged, or made for something else."""


@dataclass(frozen=True)
class Described:
    """What can be built again: its name in a closed list, and its settings by argument."""

    name: str
    settings: dict[str, Any]


@dataclass(frozen=True)
class Policy:
    """A policy file in memory.

    Attributes:
        model: the networks.
        observation: what they read; None if that is the map alone.
        training: how they were trained: frames, seed, world and what else the writer wrote down.
        weights: the state dict of the networks.
        source: what to call the policy in a message.
    """

    model: Described
    observation: Described | None
    training: dict[str, Any]
    weights: dict[str, Tensor] = field(repr=False)
    source: str = "this policy"

    def build(self, models: Mapping[str, Callable[..., nn.Module]], **settings: Any) -> Any:
        """Builds the networks with these weights, without gradients.

        Args:
            models: the models that may be built, by name.
            settings: of the model, in place of the file's own.

        Raises:
            CheckpointError: if the model is not one of them, or the weights do not fit it.
        """
        if self.model.name not in models:
            known = ", ".join(sorted(models))
            raise CheckpointError(
                f"{self.source} is of the model {self.model.name!r}, which is not one of {known}: "
                "give its configuration with --config-dir and model=, as in its training"
            )
        try:
            networks = models[self.model.name](**{**self.model.settings, **settings})
            networks.load_state_dict(self.weights)
        except (RuntimeError, TypeError) as error:
            text = " ".join(str(error).split())
            raise CheckpointError(f"{self.source} does not fit its model: {text}") from error
        return networks.eval().requires_grad_(False)


def policy_bytes(policy: Policy) -> bytes:
    """Gives the policy file's content.

    Raises:
        TypeError: if a setting is nothing that JSON can hold.
    """
    weights = {name: value.detach().contiguous().cpu() for name, value in policy.weights.items()}
    about = {
        "format": FORMAT,
        "model": vars(policy.model),
        "observation": None if policy.observation is None else vars(policy.observation),
        "training": policy.training,
    }
    about["sha256"] = _checksum(about, weights)
    return save(weights, metadata={_KEY: json.dumps(about, sort_keys=True)})


def save_policy(path: Path, policy: Policy) -> None:
    """Writes a policy file, whole or not at all."""
    atomic_write(path, policy_bytes(policy))


def load_policy(path: str | Path) -> Policy:
    """Reads a policy file.

    Args:
        path: the file, or a run folder (its best checkpoint, else its latest).

    Raises:
        CheckpointError: if there is none, or it cannot be read; the message says why.
    """
    path = find_policy(Path(path))
    if not os.access(path, os.R_OK):
        raise CheckpointError(f"checkpoint={path} cannot be read: permission denied")
    try:
        with safe_open(path, framework="pt") as file:
            header = file.metadata() or {}
            weights = {name: file.get_tensor(name) for name in file.keys()}
    except (SafetensorError, OSError) as error:
        raise CheckpointError(f"checkpoint={path} cannot be read as a policy: {error}") from error
    try:
        policy = _described(header, weights, f"checkpoint={path}")
    except (KeyError, TypeError, AttributeError, json.JSONDecodeError) as error:
        raise CheckpointError(
            f"checkpoint={path} cannot be read as a policy: its header is damaged: {error!r}"
        ) from error
    broken = [name for name, value in weights.items() if not value.isfinite().all()]
    if broken:
        raise CheckpointError(f"checkpoint={path} has weights that are not finite: {broken[0]}")
    return policy


def _described(header: Mapping[str, str], weights: dict[str, Tensor], source: str) -> Policy:
    """Reads a header of either format."""
    if header.get("format") == _OLD_FORMAT:
        model, window, training = (json.loads(header[n]) for n in ("model", "window", "training"))
        observation = Described("exploration_graph", {"window": window})
        return Policy(Described("gatv2", model), observation, training, weights, source)
    if _KEY not in header:
        raise CheckpointError(f"{source} is a safetensors file but not a policy of this program")
    about = json.loads(header[_KEY])
    if about["format"] != FORMAT:
        raise CheckpointError(f"{source} has format {about['format']}, this program reads {FORMAT}")
    if about.pop("sha256") != _checksum(about, weights):
        raise CheckpointError(f"{source} is damaged: its checksum is not that of its content")
    reads = about["observation"] and Described(**about["observation"])
    return Policy(Described(**about["model"]), reads, about["training"], weights, source)


def _checksum(about: Mapping[str, Any], weights: Mapping[str, Tensor]) -> str:
    digest = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
    for name in sorted(weights):
        value = weights[name].contiguous()
        digest.update(f"{name} {value.dtype} {list(value.shape)}".encode())
        digest.update(value.view(-1).view(torch.uint8).numpy().tobytes())
    return digest.hexdigest()


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


def require_same(policy: Policy, wanted: Mapping[str, Any]) -> None:
    """Refuses a policy made with other settings than those asked for.

    Args:
        policy: the policy.
        wanted: settings of its model and its observation by name, ``model.hidden`` or
            ``graph.window``; one that the policy says nothing of is not looked at.

    Raises:
        CheckpointError: naming the first that differs and both values.
    """
    parts: dict[str, Described | None] = {"model": policy.model, "graph": policy.observation}
    for name, value in wanted.items():
        part, _, setting = name.partition(".")
        described = parts[part]
        made_for = value if described is None else described.settings.get(setting, value)
        if made_for != value:
            raise CheckpointError(
                f"{policy.source} was made with {name}={made_for}, but {name}={value} was asked for"
            )
