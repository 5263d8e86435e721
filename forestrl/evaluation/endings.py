"""How episodes end: covered, out of steps, or stuck and why."""

from __future__ import annotations

from enum import IntEnum

import torch
from torch import Tensor

from forestrl.status import Status


class Ending(IntEnum):
    """How an episode ended."""

    COVERED = 0
    """The coverage goal was reached, whatever came after."""
    BUDGET = 1
    """The steps were used up while the planner was still exploring."""
    NO_REACHABLE_FRONTIER = 2
    """The planner's map had nothing left for it, though the goal was not reached."""
    CYCLE = 3
    """The planner went round for ever."""
    AT_GOAL = 4
    """The planner's goal was its own cell."""
    GOAL_NOT_FREE = 5
    """The planner's goal was a tree or lay outside the arena."""


_OF_STATUS = {
    Status.EXPLORING: Ending.BUDGET,
    Status.COVERED: Ending.NO_REACHABLE_FRONTIER,
    Status.NO_REACHABLE_FRONTIER: Ending.NO_REACHABLE_FRONTIER,
    Status.CYCLE: Ending.CYCLE,
    Status.AT_GOAL: Ending.AT_GOAL,
    Status.GOAL_NOT_FREE: Ending.GOAL_NOT_FREE,
}


def ending(status: Tensor, covered: Tensor) -> Tensor:
    """Says how episodes ended, from the planner's last status and from what was reached.

    Args:
        status: last ``("planner", "status")``, int8 ``[*B]``.
        covered: whether the coverage goal was reached, bool ``[*B]``.

    Returns:
        :class:`Ending`, int8 ``[*B]``.

    Examples:
        >>> statuses = torch.tensor([Status.CYCLE, Status.EXPLORING])
        >>> [Ending(i).name for i in ending(statuses, torch.tensor(False)).tolist()]
        ['CYCLE', 'BUDGET']
    """
    table = torch.tensor([_OF_STATUS[each] for each in Status], device=status.device)
    return torch.where(covered, int(Ending.COVERED), table[status.long()]).to(torch.int8)
