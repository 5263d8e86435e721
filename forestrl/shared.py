"""The settings that commands share: ``conf/world.yaml``, and what they are given to look at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from omegaconf import DictConfig

from forestrl.config import Node, OptionalNode
from forestrl.settings import Range, not_allowed

Seed = Annotated[int, Range(0, 2**63 - 1)]
Count = Annotated[int, Range(1, 1_000_000_000)]
CountOrZero = Annotated[int, Range(0, 1_000_000_000)]
Side = Annotated[int, Range(3, 1000)]


@dataclass(kw_only=True)
class World:
    """The task."""

    env: Node
    safety: OptionalNode
    graph: Node
    reward: OptionalNode
    model: Node
    seed: Seed
    device: str
    threads: Annotated[int, Range(1, 256)]
    debug: bool

    @staticmethod
    def check(cfg: DictConfig) -> None:
        """Refuses an env without a batch of arenas, which is for Python alone."""
        if cfg.env.get("num_envs") is None:
            raise not_allowed("env.num_envs", None, "it must be a whole number")


def require_forest(cfg: DictConfig) -> None:
    """Refuses a world whose size and density a command cannot vary.

    Raises:
        ValueError: if the env has no ``size`` and ``n_trees``.
    """
    if not {"size", "n_trees"} <= cfg.env.keys():
        world = cfg.env.world and cfg.env.world.get("_target_")
        reason = "this command varies env.size and env.n_trees, as env=forest has them"
        raise not_allowed("env.world", world, reason)


@dataclass(kw_only=True)
class WithPolicy(World):
    """A command that shows a policy the world; its own settings say which arenas and how long."""

    unread: ClassVar[tuple[str, ...]] = (
        "reward",
        "seed",
        "env.seed",
        "env.num_envs",
        "env.max_steps",
    )

    policy: Node
    checkpoint: Path | None

    @staticmethod
    def check(cfg: DictConfig) -> None:
        """Refuses a checkpoint that the policy would not read."""
        if cfg.checkpoint is not None and "checkpoint" not in cfg.policy:
            reason = f"policy={cfg.policy.get('name')} reads none"
            raise not_allowed("checkpoint", cfg.checkpoint, reason)
