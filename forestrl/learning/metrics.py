"""What is measured while training: one batch of experience to scalars under fixed names."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from tensordict import TensorDictBase
from torchrl.envs.transforms import Transform

from forestrl import functional as F
from forestrl import keys as K

_LEVELS = (80, 90, 98)


def summarize(batch: TensorDictBase, transforms: Iterable[Transform] = ()) -> dict[str, float]:
    """Measures a batch of experience.

    Values over episodes are taken from the episodes that end, and the levels that are crossed, in
    this batch; they are nan where there is none.

    Args:
        batch: what a collector returns, ``[*B, T]`` frames.
        transforms: those of the env. One with a method ``metrics(batch)``, a dictionary of scalars
            by name, is asked for what it knows best: a reward for its terms, an observation for its
            size.

    Returns:
        ``rollout/*``, ``safety/*``, ``reward/*`` and what the transforms measure.
    """
    metrics = rollout(batch) | safety(batch)
    for transform in transforms:
        if (measure := getattr(transform, "metrics", None)) is not None:
            metrics |= measure(batch)
    if not any(name.startswith("reward/") for name in metrics):
        metrics["reward/mean"] = _mean(batch["next", "reward"])
    return metrics


def rollout(batch: TensorDictBase) -> dict[str, float]:
    """Measures the episodes that end in the batch, and the steps to 80, 90 and 98 % coverage."""
    after = batch["next"]
    done = after["done"].squeeze(-1)
    ended = after[done]
    metrics = {
        "rollout/return": _mean(ended["episode_reward"]),
        "rollout/coverage": _mean(ended[K.COVERAGE]),
        "rollout/episode_length": _mean(ended[K.STEP_COUNT]),
        "rollout/finished": _mean(ended["terminated"]),
    }
    for level in _LEVELS:
        crossed = (batch[K.COVERAGE] < level / 100) & (after[K.COVERAGE] >= level / 100)
        metrics[f"rollout/steps_to_{level}"] = _mean(after[K.STEP_COUNT][crossed])
    return metrics


def safety(batch: TensorDictBase) -> dict[str, float]:
    """Measures what was done: shares of replaced and of null actions, collisions (must be 0)."""
    after = batch["next"]
    executed = after.get(K.EXECUTED, batch[K.ACTION])
    return {
        "safety/intervention_rate": 0.0,  # without a filter; the filter measures its own
        "safety/null_actions": _mean(executed == F.NULL_ACTION),
        "safety/collisions": float(after[K.COLLISION].sum()),
    }


def _mean(value: torch.Tensor) -> float:
    return float(value.float().mean())
