"""An episode in a test arena as an animation."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

from tensordict import TensorDictBase
from torchrl.envs import EnvBase

from forestrl.evaluation import arenas
from forestrl.rendering import record_episode, write_gif
from forestrl.storage import atomic_write


def draw_episode(
    env: EnvBase,
    policy: Callable[[TensorDictBase], TensorDictBase],
    path: Path,
    *,
    seed: int,
    arena: int,
    steps: int,
    every: int,
    fps: float = 12,
    scale: int = 7,
    frames: Path | None = None,
) -> None:
    """Plays an episode and writes it as a GIF.

    Args:
        env: a forest with its transforms, of batch size 1.
        policy: writes ``"action"``.
        path: the GIF.
        seed: seed of the test arenas.
        arena: number of the arena.
        steps: length of the episode.
        every: steps between pictures.
        fps: pictures a second.
        scale: pixels a cell.
        frames: folder for the pictures as PNG; None for none.
    """
    pictures = record_episode(
        env,
        policy,
        arenas.draw_arenas(env, seed, [arena]),
        steps,
        every,
        uniforms=arenas.uniforms(seed, [arena], steps),
        scale=scale,
        lidar_range=env.base_env.lidar_range,
    )
    write_gif(pictures, path, fps)
    if frames is None:
        return
    frames.mkdir(parents=True, exist_ok=True)
    for i, picture in enumerate(pictures):
        data = io.BytesIO()
        picture.save(data, "PNG")
        atomic_write(frames / f"{i:04}.png", data.getvalue())
