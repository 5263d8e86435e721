"""Trains an exploration policy: ``python -m forestrl.train env.n_trees=75``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from omegaconf import DictConfig

from forestrl.command import command
from forestrl.config import Node
from forestrl.shared import Count, CountOrZero, Seed, World


@dataclass(kw_only=True)
class Evaluation:
    """The periodic evaluation."""

    every: CountOrZero
    arenas: Count
    steps: Count
    seed: Seed


@dataclass(kw_only=True)
class Settings(World):
    """The settings of a training."""

    algo: Node
    logger: Node
    total_frames: Count
    episode_steps: Count
    checkpoint_every: CountOrZero
    resume: Path | None
    eval: Evaluation


@command("train", Settings)
def main(cfg: DictConfig) -> float:
    """Trains for ``cfg.total_frames``; returns the mean coverage for sweepers."""
    from forestrl.jobs import train  # here, as help and configuration need no torch

    return train.run(cfg)


if __name__ == "__main__":
    main()
