"""Counts collisions with and without the filter: ``python -m forestrl.collisions``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from omegaconf import DictConfig

from forestrl.command import command
from forestrl.settings import Range, not_allowed
from forestrl.shared import Count, CountOrZero, Seed, Side, WithPolicy, require_forest


@dataclass(kw_only=True)
class Forests:
    """The forests that collisions are counted in."""

    sizes: Annotated[list[Side], Range(1)]
    densities: Annotated[list[CountOrZero], Range(1)]
    arenas: Count
    steps: Count
    seed: Seed


@dataclass(kw_only=True)
class Settings(WithPolicy):
    """The settings of the count."""

    unread: ClassVar = (*WithPolicy.unread, "safety", "env.size", "env.n_trees")

    collisions: Forests

    @staticmethod
    def check(cfg: DictConfig) -> None:
        """Refuses another policy than the paper's, and another world than a forest."""
        require_forest(cfg)
        if cfg.policy.name != "paper":
            raise not_allowed("policy", cfg.policy.name, "the paper's is compared with random")


@command("collisions", Settings)
def main(cfg: DictConfig) -> int:
    """Runs a random and the paper's policy over sizes and densities; returns the filter's failures.

    The random policy draws among all nine actions. Without the filter both collide.
    """
    from forestrl.jobs import collisions  # here, as help and configuration need no torch

    return collisions.run(cfg)


if __name__ == "__main__":
    main()
