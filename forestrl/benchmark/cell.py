"""One cell of the benchmark: all stages at one arena side and one number of arenas."""

from __future__ import annotations

import gc
import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from tensordict import TensorDict

from forestrl import keys as K
from forestrl.benchmark import stages
from forestrl.benchmark.machine import peak_memory
from forestrl.benchmark.stages import Parts
from forestrl.benchmark.states import arrange
from forestrl.benchmark.timing import Timing, measure, timed
from forestrl.learning.metrics import summarize

LONG_UPDATE = 10
"""An update of more than this many budgets is estimated from its minibatches."""


@dataclass(frozen=True)
class Row:
    """One stage of one cell: a line of ``bench.csv``.

    ``seconds`` is one call on ``frames`` frames, and of an env stage all transforms up to it;
    ``added`` is what the stage adds to the cost of one collected frame, seconds, and ``share`` that
    as a part of the whole pipeline's. ``how`` is ``measured``, ``estimated``, or why not.
    """

    size: int
    n_trees: int
    num_envs: int
    stage: str
    frames: int = 0
    seconds: float | None = None
    frames_per_second: float | None = None
    added: float | None = None
    share: float | None = None
    percentile_99: float | None = None
    repeats: int = 0
    how: str = "measured"
    coverage: float | None = None
    frontiers: float | None = None
    peak_memory_gb: float | None = None


def measure_cell(
    make_parts: Callable[[int], Parts], worlds: TensorDict, blank: Row, seconds: float
) -> list[Row]:
    """Times all stages at one size and one number of arenas.

    Args:
        make_parts: makes what is measured, for a number of arenas.
        worlds: explored arenas of that size.
        blank: a row with size, trunks and number of arenas.
        seconds: budget for each stage.

    Returns:
        a row for each stage, in the pipeline's order.
    """
    parts, batches = make_parts(blank.num_envs), arrange(worlds, blank.num_envs)
    rows = _measure_steps(parts, batches, blank, seconds)
    rows |= _measure_learning(parts, batches[0], blank, rows, seconds)
    rows |= _measure_decisions(make_parts, worlds, blank, seconds) if blank.num_envs == 1 else {}
    added = _added(rows, list(parts.envs), parts.ppo.num_epochs)
    total = sum(added.values()) if all(row.seconds for row in rows.values()) else None
    del parts
    gc.collect()
    measured = [
        replace(
            row,
            added=added.get(name),
            share=added[name] / total if total and name in added else None,
            peak_memory_gb=peak_memory(),
        )
        for name, row in rows.items()
    ]
    return measured


def _row(blank: Row, stage: str, frames: int, timing: Timing, how: str = "measured") -> Row:
    return replace(
        blank,
        stage=stage,
        frames=frames,
        seconds=timing.median,
        frames_per_second=frames / timing.median,
        percentile_99=timing.percentile_99,
        repeats=timing.repeats,
        how=how,
    )


def measure_steps(
    parts: Parts, batches: Sequence[TensorDict], seconds: float
) -> dict[str, Timing]:
    """Times one step of each env, of the policy and of evaluation, in turns."""
    calls = {name: stages.env_step(env, batches) for name, env in parts.envs.items()}
    calls[stages.POLICY] = stages.policy_forward(parts, batches)
    calls[stages.EVALUATION] = stages.evaluation_step(parts, batches)
    return measure(calls, seconds)


def _measure_steps(
    parts: Parts, batches: Sequence[TensorDict], blank: Row, seconds: float
) -> dict[str, Row]:
    timings = measure_steps(parts, batches, seconds)
    return {name: _row(blank, name, blank.num_envs, timing) for name, timing in timings.items()}


def _measure_learning(
    parts: Parts, worlds: TensorDict, blank: Row, steps: Mapping[str, Row], seconds: float
) -> dict[str, Row]:
    """Times GAE, a minibatch and a whole iteration; skips them if no batch can be collected."""
    names = (stages.ADVANTAGE, stages.MINIBATCH, stages.ITERATION)
    ppo, collector = parts.ppo, parts.collector
    if collector is None:
        how = f"skipped: num_envs does not divide frames_per_batch={ppo.frames_per_batch}"
        return {name: replace(blank, stage=name, how=how) for name in names}
    stages.start_collecting(collector, worlds)
    collected = iter(collector)
    batch = next(collected)
    timings = measure({names[0]: stages.advantage(ppo, batch)}, seconds)
    timings |= measure({names[1]: stages.minibatch(ppo, batch)}, seconds)
    start = time.perf_counter()
    batch = next(collected)
    collect = time.perf_counter() - start
    update = ppo.num_epochs * ppo.num_minibatches * timings[names[1]].median
    update += timings[names[0]].median
    how = "estimated"
    if update <= LONG_UPDATE * seconds:
        how, update = "measured", timed(lambda: summarize(batch) | ppo.update(batch))
    timings[names[2]] = Timing(collect + update, collect + update, 1)
    collector.shutdown()
    frames = (ppo.frames_per_batch, ppo.minibatches._batch_size, ppo.frames_per_batch)
    return {
        name: _row(blank, name, n, timings[name], how if name == stages.ITERATION else "measured")
        for name, n in zip(names, frames, strict=True)
    }
