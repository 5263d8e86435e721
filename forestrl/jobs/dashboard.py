"""The workspace of Weights & Biases as code: ``forestrl dashboard``."""

from __future__ import annotations

from typing import Any

import wandb
from omegaconf import DictConfig
from wandb_workspaces import workspaces
from wandb_workspaces.reports import v2 as panels

from forestrl.loggers.wandb import logged_in, service

SECTIONS: dict[str, dict[str, tuple[str, ...]]] = {  # section: panel: its curves
    "Does it explore?": {
        "coverage in the evaluation": ("eval/coverage", "eval/auc"),
        "steps to 80, 95, 98 % there": ("eval/steps_to_80", "eval/steps_to_95", "eval/steps_to_98"),
        "coverage in training": ("rollout/coverage", "rollout/finished"),
        "return": ("rollout/return",),
    },
    "Is it safe?": {
        "share of replaced actions": ("safety/intervention_rate", "eval/intervention_rate"),
        "collisions: must be 0": ("safety/collisions", "eval/collisions"),
        "share of steps spent waiting": ("safety/null_actions",),
    },
    "What is it paid for?": {
        "terms of the reward": (
            *("reward/new_cells", "reward/potential"),
            *("reward/explored", "reward/unsafe"),
        ),
        "frontier cells": ("graph/frontiers",),
        "observations cut short: must be 0": ("graph/truncated",),
    },
    "Does it learn well?": {
        "entropy": ("loss/entropy",),
        "step of an update": ("ppo/kl_approx", "ppo/clip_fraction"),
        "explained variance": ("ppo/explained_variance",),
        "gradient norm": ("ppo/grad_norm",),
        "losses": ("loss/objective", "loss/critic"),
    },
    "How fast?": {
        "frames per second": ("time/fps",),
        "seconds an update": ("time/collect", "time/update"),
        "memory, GB": ("time/memory",),
    },
}
EPISODE = "eval/episode"
"""The animation that a training logs."""


def run(cfg: DictConfig) -> None:
    """Saves the workspace, and prints its address."""
    if not logged_in(service()):
        raise ValueError("nobody is logged in: run `wandb login`, or set WANDB_API_KEY")
    try:
        entity = cfg.entity or wandb.Api(timeout=19).default_entity
        print(workspace(str(entity), cfg.project, cfg.title).save().url)
    except Exception as error:  # of the client, whose errors share no class
        raise ValueError(f"Weights & Biases did not take the workspace: {error}") from error


def workspace(entity: str, project: str, title: str) -> Any:
    """Makes the workspace.

    Args:
        entity: the team or user.
        project: that the runs are in.
        title: in the project's list of views.

    Returns:
        a ``wandb_workspaces`` workspace, not yet saved.
    """
    sections = [
        workspaces.Section(
            name=name,
            is_open=True,
            panels=[
                panels.LinePlot(title=heading, x="frames", y=list(curves))
                for heading, curves in plots.items()
            ],
        )
        for name, plots in SECTIONS.items()
    ]
    sections[0].panels.append(panels.MediaBrowser(title="an episode", media_keys=[EPISODE]))
    return workspaces.Workspace(
        entity=entity,
        project=project,
        name=title,
        sections=sections,
        settings=workspaces.WorkspaceSettings(x_axis="frames"),
    )
