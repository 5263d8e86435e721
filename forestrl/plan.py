"""Tells a robot where to go, by lines of JSON: ``python -m forestrl.plan``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from omegaconf import DictConfig

from forestrl.command import command
from forestrl.config import Node
from forestrl.settings import Range


@dataclass(kw_only=True)
class Settings:
    """The settings of the planner."""

    planner: Node
    threads: Annotated[int, Range(1, 256)]
    debug: bool


@command("plan", Settings)
def main(cfg: DictConfig) -> None:
    """Answers each line of standard input with a line on standard output, to the end of input."""
    from forestrl.jobs import plan  # here, as help and configuration need no torch

    plan.run(cfg)


if __name__ == "__main__":
    main()
