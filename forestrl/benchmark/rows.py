"""The lines of ``bench.csv``."""

from __future__ import annotations

from dataclasses import dataclass, replace

from forestrl.benchmark.timing import Timing

_ENOUGH = 100  # repeats from which a 99th percentile means something


@dataclass(frozen=True)
class Row:
    """One stage at one arena side and number of arenas.

    Attributes:
        size: arena side, cells.
        n_trees: trunks an arena.
        num_envs: arenas stepped at once.
        stage: name of the stage, see :mod:`forestrl.benchmark.stages`.
        frames: frames that one call works on.
        seconds: median time of one call; for an env stage with all transforms up to its own.
        frames_per_second: ``frames / seconds``.
        added: seconds the stage adds to the cost of one collected frame; only in the pipeline. For
            an env stage it is the difference to the stage before (0 if that lies within the noise),
            for a minibatch all epochs count.
        share: ``added`` as a part of the whole pipeline's.
        percentile_99: 99th percentile of the time of one call, seconds; None after few repeats.
        repeats: calls that were timed.
        how: ``measured``, ``estimated``, or why the stage was skipped.
        coverage: mean coverage of the states.
        frontiers: mean number of frontier cells of the states.
        peak_memory_gb: largest resident size of the process up to here, GB (2^30 bytes); smaller
            batches and arenas are measured first.
    """

    size: int
    n_trees: int
    num_envs: int
    stage: str = ""
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

    def timed(self, stage: str, frames: int, timing: Timing, how: str = "measured") -> Row:
        """Gives this row with a stage and its timing."""
        return replace(
            self,
            stage=stage,
            frames=frames,
            seconds=timing.median,
            frames_per_second=frames / timing.median,
            percentile_99=timing.percentile_99 if timing.repeats >= _ENOUGH else None,
            repeats=timing.repeats,
            how=how,
        )
