"""Timing with :mod:`torch.utils.benchmark`: stages in turns, and a row of a CSV file for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import torch
from torch.utils.benchmark import Measurement, Timer

from forestrl.storage import csv_text

_COLUMNS = (
    "table stage version rows columns n_trees coverage frontiers max_frontiers num_envs frames "
    "seconds iqr percentile_99 repeats frames_per_second work"
).split()
About = Mapping[str, Any]
"""Columns that tell of explored arenas, ``num_envs`` of them, ``rows`` x ``columns`` cells each."""
_TURNS = 3  # of each stage beside others
_SINGLES = 500  # calls timed one by one, enough for a 99th percentile


class Stage(NamedTuple):
    """What is timed."""

    name: str
    frames: float
    """That one call is worth."""
    call: Callable[[], object]
    version: str = ""
    """Names it beside other versions of the same; empty where there are none."""


def measure(
    stages: Sequence[Stage], what: str, about: About, seconds: float, *, singly: bool = False
) -> list[Measurement]:
    """Times stages in turns, so that a slow spell of the machine hits all of them alike.

    Args:
        stages: what to time.
        what: what a time is that of, for the title of the table.
        about: the arenas.
        seconds: budget for each stage.
        singly: time 500 calls one by one instead, for their 99th percentile.

    Returns:
        the time of a frame for each stage; :func:`known` says the rest.
    """
    table = f"{about['rows']} x {about['columns']} cells: {what}"
    timers = [
        Timer(
            "call()",
            globals={"call": stage.call},
            label=table,
            sub_label=stage.name,
            description=stage.version or str(about["num_envs"]),
            num_threads=torch.get_num_threads(),
        )
        for stage in stages
    ]
    turns = _SINGLES if singly else _TURNS if len(stages) > 1 else 1
    taken = [
        timer.timeit(1) if singly else timer.blocked_autorange(min_run_time=seconds / turns)
        for timer in timers * turns
    ]
    measured = []
    for stage, calls in zip(stages, Measurement.merge(taken), strict=True):
        times = [time / stage.frames for time in calls.times]
        row = {**about, "table": table, "stage": stage.name, "version": stage.version}
        row["frames"] = stage.frames
        if singly:
            row["percentile_99"] = torch.tensor(times).quantile(0.99).item()
        measured.append(replace(calls, raw_times=times, metadata=row))
    return measured


def known(measured: Measurement) -> dict[str, Any]:
    """Returns the columns of the CSV file that a measurement carries."""
    return measured.metadata or {}


def to_csv(measured: Sequence[Measurement]) -> str:
    """Returns a row for each measurement: a frame's median time and quartile distance, seconds."""
    rows: list[list[Any]] = [_COLUMNS]
    for each in measured:
        row = {**known(each), "seconds": each.median, "iqr": each.iqr}
        row |= {"repeats": len(each.times), "frames_per_second": 1 / each.median}
        rows.append([row.get(name) for name in _COLUMNS])
    return csv_text(rows)
