"""Episodes in a test arena as an animation: of one policy, or of several side by side."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from PIL import Image
from tensordict import TensorDictBase
from torchrl.envs import EnvBase

from forestrl.evaluation import arenas
from forestrl.rendering import Scene, draw_frame, draw_side_by_side, in_step, play, write_gif
from forestrl.storage import atomic_write


class Player(NamedTuple):
    """A policy and the env that it plays in."""

    env: EnvBase
    """A forest with its transforms, of batch size 1."""
    policy: Callable[[TensorDictBase], TensorDictBase]
    """Writes ``"action"``."""


def draw_episode(
    players: Mapping[str, Player],
    path: Path,
    *,
    seed: int,
    arena: int,
    steps: int,
    every: int,
    fps: float = 12,
    scale: int | None = None,
    frames: Path | None = None,
) -> None:
    """Plays an episode up to the coverage goal and writes it as a GIF, while it is played.

    Several policies play in the same arena with the same draws, and are drawn side by side.

    Args:
        players: by name.
        path: the GIF.
        seed: seed of the test arenas.
        arena: number of the arena.
        steps: length of the episode at the most.
        every: steps between pictures.
        fps: pictures a second.
        scale: pixels a cell; None for what suits the arena.
        frames: folder for the pictures as PNG; None for none.
    """

    def scenes(player: Player) -> Iterator[Scene]:
        return play(
            player.env,
            player.policy,
            arenas.draw_arenas(player.env, seed, [arena]),
            steps=steps,
            every=every,
            uniforms=arenas.uniforms(seed, [arena], steps),
        )

    episodes = {name: scenes(player) for name, player in players.items()}
    if len(episodes) == 1:
        (episode,) = episodes.values()
        pictures = (draw_frame(scene, scale) for scene in episode)
    else:
        pictures = (draw_side_by_side(each, steps, scale) for each in in_step(episodes))
    write_gif(pictures if frames is None else _kept(pictures, frames), path, fps)


def _kept(pictures: Iterable[Image.Image], folder: Path) -> Iterator[Image.Image]:
    """Writes each picture as a PNG before it is passed on."""
    folder.mkdir(parents=True, exist_ok=True)
    for i, picture in enumerate(pictures):
        data = io.BytesIO()
        picture.save(data, "PNG")
        atomic_write(folder / f"{i:04}.png", data.getvalue())
        yield picture
