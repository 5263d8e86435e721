"""A picture of an episode: ``forestrl render``."""

from __future__ import annotations

from omegaconf import DictConfig

from forestrl import build
from forestrl.command import asked_for, run_folder
from forestrl.evaluation.picture import draw_episode
from forestrl.jobs.players import make_players
from forestrl.jobs.worlds import say_world


def run(cfg: DictConfig) -> None:
    """Draws an episode of ``cfg.policy`` in one test arena, as a GIF and its frames as PNG."""
    folder = run_folder(cfg)
    build.prepare(cfg)
    settings, cfg = cfg.render, build.as_trained(cfg, asked_for())
    say_world(cfg)
    draw_episode(
        make_players(cfg, settings.beside),
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
