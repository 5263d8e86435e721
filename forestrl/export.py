"""Writes what other programs read: ``python -m forestrl.export what=map env=stems``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from omegaconf import DictConfig

from forestrl.command import command
from forestrl.settings import Range
from forestrl.shared import CountOrZero, Seed, World


@dataclass(kw_only=True)
class Arena:
    """The test arena, and the files it becomes."""

    seed: Seed
    arena: CountOrZero
    image: Literal["pgm", "png"]
    cell_size: Annotated[float, Range(above=0, high=1000)]


@dataclass(kw_only=True)
class Settings(World):
    """The settings of an export."""

    unread: ClassVar[tuple[str, ...]] = (
        *("safety", "graph", "reward", "model", "seed", "device"),
        *("env.lidar_range", "env.coverage_goal", "env.max_steps", "env.num_envs", "env.seed"),
    )

    what: Literal["map"]
    export: Arena


@command("export", Settings)
def main(cfg: DictConfig) -> None:
    """Writes a test arena of ``cfg.env`` as files of ROS's map_server."""
    from forestrl.jobs import export  # here, as help and configuration need no torch

    export.run(cfg)


if __name__ == "__main__":
    main()
