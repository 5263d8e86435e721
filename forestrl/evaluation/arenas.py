"""Test arenas: arena ``i`` and the draws made in it depend on ``(seed, i)`` and nothing else."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import torch
from tensordict import TensorDict
from torch import Tensor
from torchrl.envs import EnvBase

from forestrl import keys as K


def arena_generator(seed: int, index: int, stream: str) -> torch.Generator:
    """Makes the CPU generator of one arena and one purpose.

    Args:
        seed: seed of the whole evaluation.
        index: number of the arena.
        stream: what is drawn, so that one purpose does not disturb another.

    Returns:
        a generator with a 64-bit seed that is a hash of all three.

    Examples:
        >>> torch.rand(1, generator=arena_generator(0, 7, "arena")).item() < 1
        True
    """
    digest = hashlib.sha256(f"{seed}/{index}/{stream}".encode()).digest()
    return torch.Generator().manual_seed(int.from_bytes(digest[:8], "little"))


def draw_arenas(env: EnvBase, seed: int, indices: Sequence[int]) -> TensorDict:
    """Draws test arenas as ``env.reset`` takes them.

    Args:
        env: a forest, transformed or not; gives the world and the device.
        seed: seed of the whole evaluation.
        indices: numbers of the arenas, ``n`` of them.

    Returns:
        ``("arena", "trees")`` bool ``[n, H, W]`` and ``("agent", "position")`` int64 ``[n, 2]``.
    """
    forest = getattr(env, "base_env", env)
    sample = forest.world.sample
    worlds = [sample((), generator=arena_generator(seed, i, "arena")) for i in indices]
    trees, position = (torch.stack(parts) for parts in zip(*worlds, strict=True))
    arenas = TensorDict({K.TREES: trees, K.POSITION: position}, batch_size=[len(worlds)])
    return arenas.to(forest.device)


def uniforms(seed: int, indices: Sequence[int], steps: int) -> Tensor:
    """Draws the numbers that stochastic policies sample their actions with.

    Args:
        seed: seed of the whole evaluation.
        indices: numbers of the arenas, ``n`` of them.
        steps: how many; a longer row begins with the shorter one.

    Returns:
        float32 ``[n, steps]``, uniform in [0, 1).
    """
    rows = [torch.rand(steps, generator=arena_generator(seed, i, "actions")) for i in indices]
    return torch.stack(rows)
