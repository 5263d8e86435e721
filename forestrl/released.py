"""The policies that come with the package, and the models that a policy file may name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from torch import nn

from forestrl.explorer import LinearScore, ViewpointGATv2
from forestrl.policies.files import find_policy, load_policy
from forestrl.policies.gatv2 import GATv2ActorCritic

MODELS: Mapping[str, Callable[..., nn.Module]] = MappingProxyType(
    {"gatv2": GATv2ActorCritic, "linear_score": LinearScore, "viewpoint_gatv2": ViewpointGATv2}
)
"""The models that a policy file may name; each has a ``make_policy``."""
RELEASED = {
    name: Path(__file__).parent / "policies" / "assets" / f"{name}.safetensors"
    for name in ("explorer", "linear", "paper")
}
"""The released policies' files."""


def policy_file(checkpoint: str | Path | None, released: str = "explorer") -> Path:
    """Finds the file of a policy: the one that is asked for, else a released one.

    Args:
        checkpoint: a policy file or a run folder; None for the released policy.
        released: its name.

    Raises:
        CheckpointError: if there is none.
    """
    return RELEASED[released] if checkpoint is None else find_policy(Path(checkpoint))


def learned_policy(
    checkpoint: str | Path | None = None,
    deterministic: bool | None = None,
    *,
    released: Literal["explorer", "linear", "paper"] = "explorer",
    models: Mapping[str, Callable[..., nn.Module]] = MODELS,
    settings: Mapping[str, Any] | None = None,
) -> Any:
    """Loads a policy for use.

    Args:
        checkpoint: a policy file or a run folder; None for the released policy.
        deterministic: take the most probable action instead of a sampled one; None for what the
            model is meant for.
        released: which of the released policies: ``"explorer"``, ``"linear"`` or ``"paper"``.
        models: the models that may be built, by name.
        settings: of the model, in place of the file's own.

    Returns:
        a module that writes ``"action"``; its ``file`` says what it reads and how it was trained.

    Raises:
        CheckpointError: if there is no such policy, or it cannot be built.
        ValueError: if a deterministic model is asked to sample.
    """
    file = load_policy(policy_file(checkpoint, released))
    policy = file.build(models, **(settings or {})).make_policy(deterministic)
    policy.file = file
    return policy


def released_linear_score() -> LinearScore:
    """Gives the linear score that the explorer begins with."""
    return load_policy(RELEASED["linear"]).build(MODELS)
