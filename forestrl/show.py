"""Writes a page that plays an episode: ``python -m forestrl.show policy=path_gain``."""

from __future__ import annotations

from dataclasses import dataclass

from omegaconf import DictConfig

from forestrl.command import command
from forestrl.shared import Count, CountOrZero, Seed, WithPolicy


@dataclass(kw_only=True)
class Episode:
    """The episode of the page."""

    beside: list[str] | None
    seed: Seed
    arena: CountOrZero
    steps: Count


@dataclass(kw_only=True)
class Settings(WithPolicy):
    """The settings of a page."""

    show: Episode


@command("show", Settings)
def main(cfg: DictConfig) -> None:
    """Writes a page that plays an episode of ``cfg.policy`` in one test arena."""
    from forestrl.jobs import show  # here, as help and configuration need no torch

    show.run(cfg)


if __name__ == "__main__":
    main()
