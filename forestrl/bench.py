"""Measures how fast training and deciding are: ``python -m forestrl.bench model.kernel=pyg``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from omegaconf import DictConfig

from forestrl.command import command
from forestrl.config import Node
from forestrl.settings import Range
from forestrl.shared import Count, Side, World

Sides = Annotated[list[Side | tuple[Side, Side]], Range(1)]
Counts = Annotated[list[Count], Range(1)]


@dataclass(kw_only=True)
class Budget:
    """What is measured, and for how long."""

    num_envs: Counts
    sizes: Sides
    seconds: Annotated[float, Range(above=0, high=3600)]
    scaling: bool
    scaling_num_envs: Counts
    scaling_sizes: Sides


@dataclass(kw_only=True)
class Settings(World):
    """The settings of the benchmark."""

    algo: Node
    episode_steps: Count
    bench: Budget


@command("bench", Settings)
def main(cfg: DictConfig) -> None:
    """Measures, writes and prints the tables."""
    from forestrl.jobs import bench  # here, as help and configuration need no torch

    bench.run(cfg)


if __name__ == "__main__":
    main()
