"""Draws an episode: ``python -m forestrl.render policy=nearest_frontier render.arena=3``."""

from __future__ import annotations

from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from forestrl import build
from forestrl.command import asked_for, command
from forestrl.evaluation.picture import draw_episode


@command("render")
def main(cfg: DictConfig) -> None:
    """Draws an episode of ``cfg.policy`` in one test arena, as a GIF and its frames as PNG."""
    folder = Path(HydraConfig.get().runtime.output_dir)
    build.prepare(cfg)
    build.make_output_folder(folder)
    cfg = build.as_trained(cfg, asked_for())
    policy, _ = build.make_policy(cfg, asked_for())
    settings = cfg.render
    build.require_positive(cfg, "render.steps", "render.every", "render.fps", "render.scale")
    draw_episode(
        build.make_env(cfg, 1, policy),
        policy,
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


if __name__ == "__main__":
    main()
