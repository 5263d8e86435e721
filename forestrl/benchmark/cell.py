"""One cell of the benchmark: all stages at one arena side and one number of arenas."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from tensordict import TensorDict, TensorDictBase

from forestrl.benchmark import stages
from forestrl.benchmark.machine import peak_memory
from forestrl.benchmark.rows import Row
from forestrl.benchmark.stages import Parts
from forestrl.benchmark.timing import Timing, measure, summary
from forestrl.learning.metrics import summarize
from forestrl.learning.ppo import PPO

LONG_UPDATE = 10
"""An update of more than this many budgets is estimated from its minibatches."""

_DECISIONS = 500  # at least, for the 99th percentile
_ITERATIONS = 5  # at most


def measure_cell(
    parts: Parts, batches: Sequence[TensorDict], blank: Row, seconds: float
) -> list[Row]:
    """Times all stages but the single decision.

    Args:
        parts: what is measured.
        batches: explored arenas, from :func:`forestrl.benchmark.states.arrange`.
        blank: a row that says what the cell is.
        seconds: budget for each stage.

    Returns:
        a row for each stage: the pipeline, then a training iteration and an evaluation step.
    """
    timings = measure_steps(parts, batches, seconds)
    rows = {name: blank.timed(name, blank.num_envs, timing) for name, timing in timings.items()}
    rows |= _measure_learning(parts, batches[0], blank, seconds)
    rows[stages.EVALUATION] = rows.pop(stages.EVALUATION)  # last
    return [replace(row, peak_memory_gb=peak_memory()) for row in _with_shares(rows, parts)]


def measure_steps(parts: Parts, batches: Sequence[TensorDict], seconds: float) -> dict[str, Timing]:
    """Times one step of each env, of the policy and of evaluation, in turns."""
    calls = {name: stages.env_step(env, batches) for name, env in parts.envs.items()}
    calls[stages.POLICY] = stages.policy_forward(parts, batches)
    calls[stages.EVALUATION] = stages.evaluation_step(parts, batches)
    return measure(calls, seconds)


def measure_decision(
    parts: Parts, batches: Sequence[TensorDict], blank: Row, seconds: float
) -> list[Row]:
    """Times a single decision, without and with the filter.

    Args:
        parts: those of one arena.
        batches: one explored arena each.
        blank: a row that says what the cell is.
        seconds: budget for each of the two.
    """
    timings = measure(stages.decision(parts, batches), seconds, least=_DECISIONS)
    rows = [blank.timed(name, 1, timing) for name, timing in timings.items()]
    return [replace(row, peak_memory_gb=peak_memory()) for row in rows]


def _measure_learning(
    parts: Parts, worlds: TensorDict, blank: Row, seconds: float
) -> dict[str, Row]:
    """Times GAE, a minibatch and a whole iteration; skips them if no batch can be collected."""
    names = (stages.ADVANTAGE, stages.MINIBATCH, stages.ITERATION)
    ppo = parts.ppo
    if parts.make_collector is None:
        how = f"skipped: it does not divide frames_per_batch={ppo.frames_per_batch}"
        return {name: replace(blank, stage=name, how=how) for name in names}
    collector = parts.make_collector()
    stages.start_collecting(collector, worlds)
    collected = iter(collector)
    batch = next(collected)  # the first of a process also compiles
    advantage = measure({"": stages.advantage(ppo, batch)}, seconds)[""]
    minibatch = measure({"": stages.minibatch(ppo, batch)}, seconds)[""]
    minibatches = ppo.num_epochs * ppo.frames_per_batch // ppo.minibatch_size
    update = advantage.median + minibatches * minibatch.median
    short = update <= LONG_UPDATE * seconds
    iteration = _measure_iteration(ppo, collected, None if short else update, seconds)
    collector.shutdown()
    how = "measured" if short else "estimated"
    return {
        names[0]: blank.timed(names[0], ppo.frames_per_batch, advantage),
        names[1]: blank.timed(names[1], ppo.minibatch_size, minibatch),
        names[2]: blank.timed(names[2], ppo.frames_per_batch, iteration, how),
    }


def _measure_iteration(
    ppo: PPO, collected: Iterator[TensorDictBase], update: float | None, seconds: float
) -> Timing:
    """Times iterations until half the time of a long update has passed; once at least.

    Args:
        ppo: learns.
        collected: gives batches.
        update: estimate to take for the update; None to measure it.
        seconds: budget for one stage.
    """
    times: list[float] = []
    while sum(times) < LONG_UPDATE / 2 * seconds and len(times) < _ITERATIONS:
        start = time.perf_counter()
        batch = next(collected)
        if update is None:
            summarize(batch) | ppo.update(batch)
        times.append(time.perf_counter() - start + (update or 0.0))
    return summary(times)


def _with_shares(rows: Mapping[str, Row], parts: Parts) -> Iterable[Row]:
    """Fills in what the stages of the pipeline add, if all of them were measured."""
    added, before = {}, 0.0
    for name in (*parts.envs, *stages.LEARNING):
        if (seconds := rows[name].seconds) is None:
            return rows.values()
        each = seconds / rows[name].frames
        if name in parts.envs:
            added[name] = max(each - before, 0.0)
            before = max(each, before)
        else:
            added[name] = each * (parts.ppo.num_epochs if name == stages.MINIBATCH else 1)
    total = sum(added.values())
    return [
        replace(row, added=added[name], share=added[name] / total) if name in added else row
        for name, row in rows.items()
    ]
