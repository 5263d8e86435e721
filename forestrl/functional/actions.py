"""Actions: Table I's displacements, feasibility, and the safety filter's rule (Algorithm 1)."""

from __future__ import annotations

import torch
from torch import Tensor

from forestrl.functional.grid import Cell, gather

DISPLACEMENTS = torch.tensor(
    [(0, 0), (-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]
)
"""Table I: the (row, col) displacement of action ``a^(i)``, int64 ``[9, 2]``."""

NULL_ACTION = 0
"""``a^(0)``, staying in place: always feasible."""


def targets(position: Tensor) -> Tensor:
    """Gives the cell each action leads to: int64 ``[*B, 9, 2]`` from ``[*B, 2]``."""
    return position.unsqueeze(-2) + DISPLACEMENTS.to(position.device)


def feasible(cells: Tensor, position: Tensor) -> Tensor:
    """Tells which actions are feasible on the agent's map.

    An action is feasible if its target lies inside the arena and is known to be free; an unknown
    target is infeasible; the null action is always feasible.

    Args:
        cells: the agent's map, ``Cell`` values, uint8 ``[*B, H, W]``.
        position: the agent's cell, int64 ``[*B, 2]``.

    Returns:
        bool ``[*B, 9]``.
    """
    is_free = gather(cells, targets(position), outside=Cell.OCCUPIED) == Cell.FREE
    is_free[..., NULL_ACTION] = True
    return is_free


def safe_action(action: Tensor, feasible: Tensor) -> Tensor:
    """Replaces an infeasible action by the nearest feasible one (Algorithm 1).

    Nearest means the smallest difference of action indices among the feasible actions other than
    the null action, ties going to the lower index; if there is none, the null action.

    Args:
        action: the policy's action ``u^pi``, int64 ``[*B]``.
        feasible: bool ``[*B, 9]``.

    Returns:
        the executed action ``u^sigma``, int64 ``[*B]``.

    Examples:
        >>> free = torch.tensor([True, False, False, False, True, False, True, False, False])
        >>> safe_action(torch.tensor(5), free).item()  # 4 and 6 are equally near
        4
    """
    index = torch.arange(feasible.shape[-1], device=action.device)
    distance = (index - action.unsqueeze(-1)).abs()
    distance = distance.masked_fill(~feasible, feasible.shape[-1])
    distance[..., NULL_ACTION] = feasible.shape[-1] - 1  # taken only if nothing else is feasible
    keep = feasible.gather(-1, action.unsqueeze(-1)).squeeze(-1)
    return torch.where(keep, action, distance.argmin(-1))


def move(trees: Tensor, position: Tensor, action: Tensor) -> tuple[Tensor, Tensor]:
    """Moves the agent in the true arena.

    Args:
        trees: occupied cells, bool ``[*B, H, W]``.
        position: the agent's cell, int64 ``[*B, 2]``.
        action: int64 ``[*B]``.

    Returns:
        the new position ``[*B, 2]``, and where the target was a trunk or outside the arena, bool
        ``[*B]``: there the agent stays where it is.
    """
    target = position + DISPLACEMENTS.to(position.device)[action]
    collision = gather(trees, target.unsqueeze(-2), outside=True).squeeze(-1)
    return torch.where(collision.unsqueeze(-1), position, target), collision


def sample_action(weight: Tensor, uniform: Tensor) -> Tensor:
    """Draws an action by inverting the cumulative distribution.

    Args:
        weight: probabilities of the actions up to a common factor, float ``[*B, 9]``, not all 0.
        uniform: draws from [0, 1), float ``[*B]``.

    Returns:
        int64 ``[*B]``.

    Examples:
        >>> sample_action(torch.tensor([0.0, 1.0, 3.0]), torch.tensor(0.25)).item()
        2
    """
    cumulative = weight.double().cumsum(-1)
    below = cumulative <= uniform.double().unsqueeze(-1) * cumulative[..., -1:]
    return below.sum(-1)


def check_action(action: Tensor) -> None:
    """Refuses actions that Table I does not list.

    Args:
        action: int64 ``[*B]``.

    Raises:
        ValueError: naming the first of them.
    """
    wrong = (action < 0) | (action >= len(DISPLACEMENTS))
    if wrong.any():
        first = int(action[wrong].flatten()[0])
        raise ValueError(f"action={first} is not allowed: it must be 0 to {len(DISPLACEMENTS) - 1}")
