"""What a command says of the world before it begins."""

from __future__ import annotations

import sys

from omegaconf import DictConfig

from forestrl import build


def say_world(cfg: DictConfig) -> None:
    """Prints what the world rests on, files and assumptions, where it says so."""
    describe = getattr(build.make_forest(cfg, 1).world, "describe", None)
    if describe is not None:
        print(f"world: {describe()}", file=sys.stderr)
