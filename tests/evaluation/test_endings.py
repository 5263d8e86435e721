"""How episodes end."""

import torch

from forestrl.evaluation.endings import end_reason
from forestrl.kernels.planning import Reason


def test_end_reasons():
    raw = torch.tensor([Reason.CYCLE, Reason.CYCLE, Reason.EXPLORING, Reason.COVERED])
    covered = torch.tensor([True, False, False, False])
    assert end_reason(raw, covered).tolist() == [
        Reason.COVERED,
        Reason.CYCLE,
        Reason.BUDGET,
        Reason.NO_REACHABLE_FRONTIER,
    ]
