"""What is measured while training: one batch of experience to scalars under fixed names."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase

from forestrl import functional as F
from forestrl import keys as K

_LEVELS = (80, 90, 98)


def summarize(batch: TensorDictBase) -> dict[str, float]:
    """Measures a batch of experience.

    Values over episodes are taken from the episodes that end, and the levels that are crossed, in
    this batch; they are nan where there is none.

    Args:
        batch: what a collector returns, ``[*B, T]`` frames.

    Returns:
        ``rollout/*``, ``safety/*``, ``reward/*`` and ``graph/*``.
    """
    return rollout(batch) | safety(batch) | reward_terms(batch) | graph(batch)


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
    """Measures the filter: shares of replaced and of null actions, and collisions (must be 0)."""
    after = batch["next"]
    executed = after.get(K.EXECUTED, batch[K.ACTION])
    return {
        "safety/intervention_rate": _mean(_unsafe(batch)),
        "safety/null_actions": _mean(executed == F.NULL_ACTION),
        "safety/collisions": float(after[K.COLLISION].sum()),
    }


def reward_terms(batch: TensorDictBase) -> dict[str, float]:
    """Splits the mean reward a step into its terms (Eq. 6); they add up to it."""
    after = batch["next"]
    unsafe = _unsafe(batch) | after[K.COLLISION]
    explored = after["terminated"] & ~unsafe
    shaped = (~unsafe & ~explored).float()
    new_cells = after[K.NEW_CELLS] * shaped
    return {
        "reward/new_cells": _mean(new_cells),
        "reward/potential": _mean(after["reward"] * shaped - new_cells),
        "reward/explored": _mean(after["reward"] * explored),
        "reward/unsafe": _mean(after["reward"] * unsafe),
    }


def graph(batch: TensorDictBase) -> dict[str, float]:
    """Measures the graphs: frontier cells, and the share of graphs that had no room for all."""
    frontiers = batch[K.FRONTIERS]
    return {
        "graph/frontiers": _mean(frontiers),
        "graph/truncated": _mean(frontiers > batch[K.WAYPOINT].shape[-1]),
    }


def _unsafe(batch: TensorDictBase) -> torch.Tensor:
    after = batch["next"]
    return after.get(K.INTERVENED, torch.zeros_like(after[K.COLLISION]))


def _mean(value: torch.Tensor) -> float:
    return float(value.float().mean())
