"""A page that plays an episode: ``forestrl show``."""

from __future__ import annotations

import shlex

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from forestrl import __version__, build
from forestrl.command import asked_for, run_folder
from forestrl.evaluation import arenas
from forestrl.evaluation.picture import Player
from forestrl.jobs.players import make_players
from forestrl.pages import Recording, episode_page, record
from forestrl.storage import atomic_write


def run(cfg: DictConfig) -> None:
    """Writes a page that plays an episode of ``cfg.policy`` in one test arena."""
    folder = run_folder(cfg)
    build.prepare(cfg)
    task = build.as_trained(cfg, asked_for())
    players = make_players(task, cfg.show.beside)
    names = _together([name.replace("_", " ") for name in players])
    page = episode_page(
        {name: _recorded(player, cfg.show) for name, player in players.items()},
        title=f"{names} in test arena {cfg.show.arena}",
        about={
            "command": shlex.join(["forestrl", "show", *HydraConfig.get().overrides.task]),
            "test arena": f"{cfg.show.arena}, seed {cfg.show.seed}",
            "world": _world(task),
            "ForestRL": __version__,
        },
    )
    atomic_write(folder / "episode.html", page.encode())
    print(f"page: {folder / 'episode.html'}")


def _recorded(player: Player, settings: DictConfig) -> Recording:
    return record(
        player.env,
        player.policy,
        arenas.draw_arenas(player.env, settings.seed, [settings.arena]),
        steps=settings.steps,
        uniforms=arenas.uniforms(settings.seed, [settings.arena], settings.steps),
    )


def _world(cfg: DictConfig) -> str:
    """Writes a world as it is constructed, without its module."""
    settings = dict(cfg.env.world)
    name = settings.pop("_target_").rsplit(".", 1)[-1]
    return f"{name}({', '.join(f'{key}={value}' for key, value in settings.items())})"


def _together(names: list[str]) -> str:
    """Joins names in words.

    >>> _together(["a"]), _together(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last
