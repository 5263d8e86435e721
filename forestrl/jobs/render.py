"""A picture of an episode: ``forestrl render``."""

from __future__ import annotations

from hydra import compose
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from forestrl import build
from forestrl.command import asked_for, run_folder
from forestrl.evaluation.picture import Player, draw_episode
from forestrl.jobs.worlds import say_world


def run(cfg: DictConfig) -> None:
    """Draws an episode of ``cfg.policy`` in one test arena, as a GIF and its frames as PNG."""
    folder = run_folder(cfg)
    build.prepare(cfg)
    settings, cfg = cfg.render, build.as_trained(cfg, asked_for())
    say_world(cfg)
    draw_episode(
        make_players(cfg),
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


def make_players(cfg: DictConfig) -> dict[str, Player]:
    """Builds ``cfg.policy`` and the policies beside it, each with its env, by name.

    Raises:
        ConfigError: if a policy is named twice.
    """
    names = [cfg.policy.name, *(cfg.render.beside or [])]
    if len(set(names)) < len(names):
        raise build.ConfigError(
            f"render.beside={cfg.render.beside} is not allowed: each policy is drawn once, and "
            f"{cfg.policy.name} is drawn already"
        )
    players = {}
    for name in names:
        chosen = cfg if name == cfg.policy.name else _with_policy(cfg, name)
        policy, _ = build.make_policy(chosen, asked_for())
        players[name] = Player(build.make_env(chosen, 1, policy), policy)
    return players


def _with_policy(cfg: DictConfig, name: str) -> DictConfig:
    """Gives the configuration with another policy, as ``policy=name`` would choose it."""
    job = HydraConfig.get()
    places = [word for word in job.overrides.hydra if word.startswith("hydra.searchpath=")]
    chosen, changed = compose(job.job.config_name, [*places, f"policy={name}"]), cfg.copy()
    OmegaConf.update(changed, "policy", chosen._get_node("policy"), merge=False)
    return changed
