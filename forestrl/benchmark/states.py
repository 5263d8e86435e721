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

_HORIZON = "horizon"
_PERSISTENCE = 0.9  # chance that a walker goes straight on
_REFERENCE_AREA = 50 * 50  # cells; walks are longer in larger arenas, in proportion


def explore(forest: ForestEnv, steps: int) -> TensorDict:
    """Walks through arenas and stops at staggered times.

    Every arena gets a phase, uniform in 1 to ``steps``. A walker goes straight on or, with a chance
    of 10 %, takes another feasible direction; it stops after as many moves as its phase says, times
    the arena's area over 50^2, so that arenas of all sizes are explored to about the same share.

    Args:
        forest: gives arenas, starts and the LiDAR.
        steps: length of a training episode.

    Returns:
        what ``env.reset(..., set_state=True)`` takes; the step count is the phase.
    """
    generator = torch.Generator().manual_seed(0)
    reset = forest.reset()
    trees, traversable = reset[K.TREES], reset[K.TRAVERSABLE]
    cells, position = reset[K.CELLS], reset[K.POSITION]
    phase = torch.randint(1, steps + 1, reset.batch_size, generator=generator).to(cells.device)
    moves = (phase * cells[0].numel() / _REFERENCE_AREA).ceil()
    action = torch.zeros_like(phase)
    for step in range(int(moves.max())):
        draws = torch.rand(2, *phase.shape, generator=generator).to(cells.device)
        action = _next_action(cells, position, action, draws)
        position, _ = F.move(trees, position, action.where(step < moves, F.NULL_ACTION))
        cells, _, _ = kernels.sense(trees, traversable, cells, position, forest.sight_lines)
    td = TensorDict({K.TREES: trees, K.CELLS: cells, K.POSITION: position}, reset.batch_size)
    return td.set(K.STEP_COUNT, phase.unsqueeze(-1))


def _next_action(cells: Tensor, position: Tensor, action: Tensor, draws: Tensor) -> Tensor:
    """Keeps the direction if it is feasible, most of the time, else draws a feasible one."""
    feasible = F.feasible(cells, position)
    weight = feasible.float()
    weight[..., F.NULL_ACTION] = weight[..., 1:].sum(-1) == 0
    straight = feasible.gather(-1, action.unsqueeze(-1)).squeeze(-1) & (action != F.NULL_ACTION)
    return action.where(straight & (draws[0] < _PERSISTENCE), F.sample_action(weight, draws[1]))


def arrange(worlds: TensorDict, num_envs: int) -> list[TensorDict]:
    """Makes batches of a size that together hold every world, as far as they can be filled."""
    batches = max(1, len(worlds) // num_envs)
    return list(worlds[torch.arange(batches * num_envs) % len(worlds)].split(num_envs))


@torch.no_grad()
def enter(env: EnvBase, worlds: TensorDict) -> TensorDictBase:
    """Puts an env, whatever its transforms, into explored worlds.

    Args:
        env: of as many arenas; a training env cuts the episodes after their full length.
        worlds: from :func:`arrange`.

    Returns:
        the state to step from, with actions in turn, feasible or not.
    """
    state = env.reset(worlds.clone(), set_state=True)
    if _HORIZON in state.keys():
        state[_HORIZON] = env.full_observation_spec[_HORIZON].space.high.to(torch.int64)
    state[K.ACTION] = torch.arange(len(worlds), device=state.device) % len(F.DISPLACEMENTS)
    return state
