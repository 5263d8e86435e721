"""How episodes end."""

import torch

from forestrl.evaluation.endings import Ending, ending
from forestrl.status import Status


def test_an_episode_ends_covered_or_by_the_planners_last_status():
    last = torch.tensor([Status.CYCLE, Status.CYCLE, Status.EXPLORING, Status.COVERED])
    covered = torch.tensor([True, False, False, False])
    assert ending(last, covered).tolist() == [
        Ending.COVERED,
        Ending.CYCLE,
        Ending.BUDGET,
        Ending.NO_REACHABLE_FRONTIER,
    ]


def test_every_status_has_an_ending_of_its_own_name_or_one_of_the_two_that_differ():
    found = ending(torch.tensor(list(Status)), torch.tensor(False)).tolist()
    names = {status.name: Ending(each).name for status, each in zip(Status, found, strict=True)}
    differ = {name: end for name, end in names.items() if name != end}
    assert differ == {"EXPLORING": "BUDGET", "COVERED": "NO_REACHABLE_FRONTIER"}
