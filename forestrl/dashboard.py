"""Saves a workspace for a project on Weights & Biases: ``python -m forestrl.dashboard``."""

from __future__ import annotations

from dataclasses import dataclass

from omegaconf import DictConfig

from forestrl.command import command


@dataclass(kw_only=True)
class Settings:
    """The settings of the dashboard."""

    project: str
    entity: str | None
    title: str
    debug: bool


@command("dashboard", Settings)
def main(cfg: DictConfig) -> None:
    """Saves a new view in ``cfg.project``, and says where it is."""
    from forestrl.jobs import dashboard  # here, as help and configuration need no wandb

    dashboard.run(cfg)


if __name__ == "__main__":
    main()
