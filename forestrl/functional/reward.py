"""The reward: frontier potential and its three cases (Eqs. 6 to 9)."""

from __future__ import annotations

import torch
from torch import Tensor

from forestrl.functional.frontier import frontier
from forestrl.functional.grid import Cell, window_counts


def distance(position: Tensor, size: tuple[int, int]) -> Tensor:
    """Gives the scaled distance of every cell from the agent (Eq. 7).

    Args:
        position: int64 ``[*B, 2]``.
        size: rows and columns of the arena.

    Returns:
        the Euclidean distance over the arena's diagonal between cell centres, ``sqrt(2) (h - 1)``
        for a square one: float32 ``[*B, H, W]`` in [0, 1].
    """
    row = torch.arange(size[0], device=position.device).unsqueeze(-1)
    col = torch.arange(size[1], device=position.device)
    square = (row - position[..., 0, None, None]) ** 2 + (col - position[..., 1, None, None]) ** 2
    diagonal = ((size[0] - 1) ** 2 + (size[1] - 1) ** 2) ** 0.5
    return square.float().sqrt() / diagonal


def information_gain(cells: Tensor, window: int) -> Tensor:
    """Gives the share of unknown cells in the ``k x k`` window around every cell (Eq. 8).

    Args:
        cells: the agent's map, uint8 ``[*B, H, W]``.
        window: ``k``, odd, cells.

    Returns:
        float32 ``[*B, H, W]`` in [0, 1].
    """
    return window_counts(cells == Cell.UNKNOWN, window) / window**2


def potential(cells: Tensor, position: Tensor, *, window: int, beta: float) -> Tensor:
    """Gives the frontier potential of a state (Eq. 9).

    It is the largest of ``(-d + beta * gain + 1) / (1 + beta)`` over the frontiers, with distance
    and gain scaled to [0, 1].

    Args:
        cells: the agent's map, uint8 ``[*B, H, W]``.
        position: int64 ``[*B, 2]``.
        window: ``k``, odd, cells.
        beta: weight of the information gain against the distance.

    Returns:
        ``Phi(s)``, float32 ``[*B, 1]`` in [0, 1]; 0 without frontiers.
    """
    gain = information_gain(cells, window)
    height, width = cells.shape[-2:]
    value = (1 - distance(position, (height, width)) + beta * gain) / (1 + beta)
    return (value * frontier(cells)).flatten(-2).amax(-1, keepdim=True)


def reward(
    new_cells: Tensor,
    potential: Tensor,
    next_potential: Tensor,
    *,
    explored: Tensor,
    unsafe: Tensor,
    r_explored: float,
    r_unsafe: float,
) -> Tensor:
    """Gives the reward of a step (Eq. 6).

    Args:
        new_cells: cells that became known in the step, ``n^e``, float ``[*B, 1]``.
        potential: ``Phi(s_t)``, float ``[*B, 1]``.
        next_potential: ``Phi(s_{t+1})``, float ``[*B, 1]``.
        explored: whether the coverage has reached its goal, bool ``[*B, 1]``.
        unsafe: whether the filter replaced the action, bool ``[*B, 1]``; wins over ``explored``.
        r_explored: ``r_exp``.
        r_unsafe: ``r_sigma``.

    Returns:
        float ``[*B, 1]``.

    Examples:
        >>> yes, no = torch.tensor([True]), torch.tensor([False])
        >>> reward(torch.tensor([7.0]), torch.tensor([0.75]), torch.tensor([0.5]),
        ...        explored=no, unsafe=no, r_explored=100.0, r_unsafe=-5.0).item()
        6.75
    """
    value = new_cells + next_potential - potential
    value = torch.where(explored, r_explored, value)
    return torch.where(unsafe, r_unsafe, value)
