"""Draws an episode: ``python -m forestrl.render policy=nearest_frontier render.arena=3``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from omegaconf import DictConfig

from forestrl.command import command
from forestrl.settings import Range
from forestrl.shared import Count, CountOrZero, Seed, WithPolicy


@dataclass(kw_only=True)
class Episode:
    """The episode and its picture."""

    beside: list[str] | None
    seed: Seed
    arena: CountOrZero
    steps: Count
    every: Count
    fps: Annotated[int, Range(1, 50)]
    scale: Annotated[int, Range(1, 50)] | None
    frames: bool


@dataclass(kw_only=True)
class Settings(WithPolicy):
    """The settings of a picture."""

    render: Episode


@command("render", Settings)
def main(cfg: DictConfig) -> None:
    """Draws an episode of ``cfg.policy`` in one test arena, as a GIF and its frames as PNG."""
    from forestrl.jobs import render  # here, as help and configuration need no torch

    render.run(cfg)


if __name__ == "__main__":
    main()
