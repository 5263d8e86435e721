"""Measures a policy on test arenas: ``python -m forestrl.eval policy=nearest_frontier``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from omegaconf import DictConfig

from forestrl.command import command
from forestrl.config import Node
from forestrl.shared import Count, CountOrZero, Seed, WithPolicy


@dataclass(kw_only=True)
class Evaluation:
    """The test arenas."""

    arenas: Count
    steps: Count
    seed: Seed
    first: CountOrZero
    batch: Count


@dataclass(kw_only=True)
class Settings(WithPolicy):
    """The settings of an evaluation."""

    logger: Node
    resume: Path | None
    eval: Evaluation


@command("eval", Settings)
def main(cfg: DictConfig) -> float:
    """Evaluates ``cfg.policy``; returns the mean coverage at the end, for sweepers."""
    from forestrl.jobs import eval  # here, as help and configuration need no torch

    return eval.run(cfg)


if __name__ == "__main__":
    main()
