"""How episodes end: covered, stuck and why, or out of steps."""

from __future__ import annotations

import torch
from torch import Tensor

from forestrl.kernels.planning import Reason


def end_reason(reason: Tensor, covered: Tensor) -> Tensor:
    """Says how episodes ended, from the planner's last reason and from what was reached.

    Args:
        reason: last ``("planner", "reason")``, int8 ``[*B]``.
        covered: whether the coverage goal was reached, bool ``[*B]``.

    Returns:
        int8 ``[*B]``: COVERED where the goal was reached, whatever the planner did then; BUDGET
        where the planner was still exploring; NO_REACHABLE_FRONTIER where its map had nothing left,
        though the goal was not reached.

    Examples:
        >>> reasons = torch.tensor([Reason.CYCLE, Reason.EXPLORING])
        >>> [Reason(i).name for i in end_reason(reasons, torch.tensor(False)).tolist()]
        ['CYCLE', 'BUDGET']
    """
    end = torch.where(reason == Reason.EXPLORING, int(Reason.BUDGET), reason)
    end = torch.where(end == Reason.COVERED, int(Reason.NO_REACHABLE_FRONTIER), end)
    return torch.where(covered, int(Reason.COVERED), end).to(torch.int8)
