"""States to measure in: arenas in all phases of a training episode, not freshly reset ones."""

from __future__ import annotations

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor
from torchrl.envs import EnvBase

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.envs import ForestEnv

POOL = 64
"""Arenas explored for each size; larger batches repeat them."""

_HORIZON = "horizon"
_PERSISTENCE = 0.9  # chance that a walker goes straight on
_REFERENCE_AREA = 50 * 50  # cells; walks are longer in larger arenas, in proportion
_SEED = 0


def explore(forest: ForestEnv, steps: int) -> TensorDict:
    """Walks through forests and stops at staggered times.

    Every arena gets a phase, uniform in 1 to ``steps``. A walker goes straight on or, with a chance
    of 10 %, takes another feasible direction; it stops after as many moves as its phase says, times
    ``h^2 / 50^2``, so that all sizes are explored to about the same share.

    Args:
        forest: gives trunks, starts and the LiDAR.
        steps: length of a training episode.

    Returns:
        ``trees``, ``start``, ``cells``, ``position`` and ``phase``, all ``[*B, ...]``.
    """
    generator = torch.Generator().manual_seed(_SEED)
    reset = forest.reset()
    trees, traversable = reset[K.TREES], reset[K.TRAVERSABLE]
    cells, start = reset[K.CELLS], reset[K.POSITION]
    phase = torch.randint(1, steps + 1, reset.batch_size, generator=generator).to(cells.device)
    moves = (phase * forest.size**2 / _REFERENCE_AREA).ceil()
    position, action = start, torch.zeros_like(phase)
    for step in range(int(moves.max())):
        action = _next_action(cells, position, action, generator)
        position, _ = F.move(trees, position, action.where(step < moves, F.NULL_ACTION))
        cells, _, _ = kernels.sense(trees, traversable, cells, position, forest.sight_lines)
    world = {"trees": trees, "start": start, "cells": cells, "position": position, "phase": phase}
    return TensorDict(world, batch_size=reset.batch_size)


def _next_action(
    cells: Tensor, position: Tensor, action: Tensor, generator: torch.Generator
) -> Tensor:
    """Keeps the direction if it is feasible, most of the time, else draws a feasible one."""
    feasible = F.feasible(cells, position)
    weight = feasible.float()
    weight[..., F.NULL_ACTION] = weight[..., 1:].sum(-1) == 0
    draws = torch.rand(2, *action.shape, generator=generator).to(cells.device)
    straight = feasible.gather(-1, action.unsqueeze(-1)).squeeze(-1) & (action != F.NULL_ACTION)
    return action.where(straight & (draws[0] < _PERSISTENCE), F.sample_action(weight, draws[1]))


def arrange(worlds: TensorDict, num_envs: int) -> list[TensorDict]:
    """Makes batches of a size that together hold every world, as far as they can be filled."""
    pool = len(worlds)
    if num_envs >= pool:
        return [worlds[torch.arange(num_envs) % pool]]
    return [worlds[i * num_envs : (i + 1) * num_envs] for i in range(pool // num_envs)]


@torch.no_grad()
def enter(env: EnvBase, worlds: TensorDict) -> TensorDictBase:
    """Puts an env, whatever its transforms, into explored worlds.

    The agent stays in place for one step, so that all that the transforms write is there. The phase
    becomes ``"step_count"``; a training env cuts the episode after its full length.

    Args:
        env: an env of as many arenas as there are worlds.
        worlds: from :func:`arrange`.

    Returns:
        the state to step from, with random actions, feasible or not.
    """
    given = TensorDict({K.TREES: worlds["trees"], K.POSITION: worlds["start"]}, env.batch_size)
    state = env.reset(given, set_state=True)
    state[K.CELLS], state[K.POSITION] = worlds["cells"], worlds["position"]
    state[K.STEP_COUNT] = worlds["phase"].unsqueeze(-1) - 1
    if _HORIZON in state.keys():
        state[_HORIZON] = env.full_observation_spec[_HORIZON].space.high.to(torch.int64)
    state[K.ACTION] = torch.zeros_like(worlds["phase"])
    state = env.step_mdp(env.step(state))
    state[K.ACTION] = torch.arange(env.batch_size.numel(), device=state.device) % len(
        F.DISPLACEMENTS
    )
    return state
