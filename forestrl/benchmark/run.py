"""The stages of one kind of arena: explored once, then measured in any number."""

from __future__ import annotations

import gc
from typing import Any

from tensordict import TensorDict
from torch.utils.benchmark import Measurement

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.benchmark.compiled import compiled
from forestrl.benchmark.measuring import About, known, measure
from forestrl.benchmark.scaling import work
from forestrl.benchmark.stages import Setup, decisions, learning_stages, steps
from forestrl.benchmark.states import arrange


def describe(worlds: TensorDict) -> dict[str, Any]:
    """Says how large explored arenas are and how far explored, and how much room graphs need."""
    cells, frontiers = worlds[K.CELLS], F.frontier(worlds[K.CELLS]).sum((-2, -1))
    coverage = F.coverage(cells, kernels.component(~worlds[K.TREES], worlds[K.POSITION]))
    return {
        "rows": cells.shape[-2],
        "columns": cells.shape[-1],
        "coverage": coverage.mean().item(),
        "frontiers": frontiers.float().mean().item(),
        "max_frontiers": (int(frontiers.max()) // 64 + 1) * 64,  # and some for those to come
    }


def measure_arenas(
    setup: Setup, worlds: TensorDict, about: About, seconds: float, *, learning: bool = True
) -> list[Measurement]:
    """Times the stages of ``about["num_envs"]`` arenas; without ``learning`` only their steps."""
    batches = arrange(worlds, about["num_envs"])
    *measured, evaluation = measure(steps(setup, batches), "a frame", about, seconds)
    for each in (*measured, evaluation):
        known(each)["work"] = work(each.sub_label, about)
    for stage in learning_stages(setup, batches[0]) if learning else ():
        measured += measure([stage], "a frame", about, seconds)
    gc.collect()  # envs and transforms refer to each other
    return [*measured, evaluation]


def measure_one(one: Setup, worlds: TensorDict, about: About, seconds: float) -> list[Measurement]:
    """Times the decisions of one robot, and compiled functions beside their references."""
    alone = decisions(one, arrange(worlds, 1))
    measured = measure(alone, "a decision", about, seconds, singly=True)
    for versions in compiled(worlds, about["max_frontiers"]):
        measured += measure(versions, "a map or graph", about, seconds)
    return measured
