"""Draws the figures and tables from their result files: ``python -m forestrl.figures``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from omegaconf import DictConfig

from forestrl.command import command


@dataclass(kw_only=True)
class Settings:
    """The settings of the figures."""

    results: Path
    page: Path | None
    readme: Path | None
    method: str
    sweep: Path | None
    debug: bool


@command("figures", Settings)
def main(cfg: DictConfig) -> None:
    """Redraws ``cfg.results``, or sums up the sweep in ``cfg.sweep``."""
    from forestrl.jobs import figures  # here, as help and configuration need no matplotlib

    figures.run(cfg)


if __name__ == "__main__":
    main()
