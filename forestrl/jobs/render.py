"""A picture of an episode: ``forestrl render``."""

from __future__ import annotations

from omegaconf import DictConfig

from forestrl import build
from forestrl.command import asked_for, run_folder
from forestrl.evaluation.picture import draw_episode
from forestrl.jobs.players import make_players


def run(cfg: DictConfig) -> None:
    """Draws an episode of ``cfg.policy`` in one test arena, as a GIF and its frames as PNG."""
    folder = run_folder(cfg)
    build.prepare(cfg)
    settings = cfg.render
    draw_episode(
        make_players(build.as_trained(cfg, asked_for()), settings.beside),
        folder / "episode.gif",
        seed=settings.seed,
        arena=settings.arena,
        steps=settings.steps,
        every=settings.every,
        fps=settings.fps,
        scale=settings.scale,
        frames=folder / "frames" if settings.frames else None,
    )
    print(f"episode: {folder / 'episode.gif'}")
