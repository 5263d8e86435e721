"""A whole episode as pictures, and as one moving picture."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs import EnvBase

from forestrl import keys as K
from forestrl.rendering import panel as P
from forestrl.rendering.frame import draw_frame
from forestrl.rendering.scene import Cell
from forestrl.storage import atomic_write

_COLOURS = 48  # of a GIF
_NEAR = 12  # of 255: no colour this near to one of the legend's
_SAMPLES = 8  # frames that its palette is made from
_FIXED = (
    *(P.INK, P.PAPER, P.FAINT, P.GROUND, P.TRUNK, P.UNKNOWN, P.OCCUPIED),
    *(P.AGENT, P.FRONTIER, P.EDGE, P.MARK, P.FEASIBLE, P.INFEASIBLE),
)


@torch.no_grad()
def record_episode(
    env: EnvBase,
    policy: Callable[[TensorDictBase], TensorDictBase],
    td_reset: TensorDictBase,
    steps: int,
    every: int,
    *,
    uniforms: Tensor | None = None,
    scale: int = 7,
    lidar_range: float = 5.0,
) -> list[Image.Image]:
    """Runs one episode and draws every few steps of it.

    The episode runs on past the coverage goal. Of several arenas the first is drawn.

    Args:
        env: the forest with its transforms.
        policy: writes ``"action"``.
        td_reset: what ``env.reset`` takes: the arena.
        steps: steps of the episode.
        every: a frame is drawn before every so many steps, and one after the last.
        uniforms: what stochastic policies sample with, ``[*B, steps]``.
        scale: side of a cell, pixels.
        lidar_range: ``l``, cells.

    Returns:
        the frames.
    """
    draw = partial(draw_frame, scale=scale, lidar_range=lidar_range)
    td = env.reset(td_reset, set_state=True) if K.TREES in td_reset else env.reset()
    frames: list[Image.Image] = []
    path: list[Cell] = []
    marks: list[Cell] = []
    for step in range(steps):
        if uniforms is not None:
            td.set(K.UNIFORM, uniforms[..., step])
        td = policy(td)
        if step % every == 0:
            frames.append(draw(_first(td), path=path, marks=marks))
        path.append(_place(td))
        td = env.step(td)
        intervened = td["next"].get(K.INTERVENED, None)
        if intervened is not None and _first(td)["next"][K.INTERVENED].item():
            marks.append(path[-1])
        td = env.step_mdp(td)
    last = _first(td).exclude(K.ACTION, K.LOGITS)
    frames.append(draw(last, path=path, marks=marks))
    return frames


def write_gif(frames: Sequence[Image.Image], path: str | os.PathLike[str], fps: float) -> Path:
    """Writes frames as a GIF that loops; all frames share one palette.

    Args:
        frames: RGB pictures of one size.
        path: the file.
        fps: frames a second; GIF rounds to hundredths of a second a frame.

    Returns:
        the path.

    Raises:
        ValueError: if there are no frames, their sizes differ, or ``fps`` is not positive.
    """
    sizes = sorted({frame.size for frame in frames})
    if len(sizes) != 1:
        raise ValueError(f"frames of one size are needed, got {sizes or 'none'}")
    if fps <= 0:
        raise ValueError(f"fps={fps} is not allowed: it must be more than 0")
    buffer = io.BytesIO()
    first, *changes = _changes(frames)
    first.save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=changes,
        transparency=_COLOURS,
        disposal=1,  # what a frame does not change stays
        duration=max(20, round(100 / fps) * 10),  # ms; viewers slow shorter ones down
        loop=0,
        optimize=False,
    )
    return atomic_write(path, buffer.getvalue())


def _changes(frames: Sequence[Image.Image]) -> list[Image.Image]:
    """Gives frames in one palette, transparent wherever a pixel stays as it was."""
    palette = _palette(frames)
    values = (palette.getpalette() or [])[: 3 * _COLOURS]
    values += [0] * (3 * (_COLOURS + 1) - len(values))  # the last one is the transparent one
    changes: list[Image.Image] = []
    before = np.full(frames[0].size[::-1], _COLOURS)
    for frame in frames:
        now = np.asarray(frame.quantize(palette=palette, dither=Image.Dither.NONE))
        change = Image.fromarray(np.where(now == before, _COLOURS, now).astype(np.uint8))
        change.putpalette(values)
        change.info["transparency"] = _COLOURS
        changes.append(change)
        before = now
    return changes


def _palette(frames: Sequence[Image.Image]) -> Image.Image:
    """Makes a palette of the colours of the legend and the commonest ones besides."""
    step = max(1, len(frames) // _SAMPLES)
    sample = [*frames[::step], frames[-1]]
    width, height = sample[0].size
    sheet = Image.new("RGB", (width, height * len(sample)))
    for i, frame in enumerate(sample):
        sheet.paste(frame, (0, i * height))
    common = sheet.quantize(_COLOURS, method=Image.Quantize.MEDIANCUT).getpalette() or []
    fixed = np.array(_FIXED)
    others = np.array(common).reshape(-1, 3)
    far = np.abs(others[:, None] - fixed).max(-1).min(-1) > _NEAR
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.concatenate((fixed, others[far]))[:_COLOURS].ravel().tolist())
    return palette


def _first(td: TensorDictBase) -> TensorDictBase:
    return td.flatten()[0] if td.batch_dims else td


def _place(td: TensorDictBase) -> Cell:
    return tuple(_first(td)[K.POSITION].tolist())
