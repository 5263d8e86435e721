"""Writes an evaluation down: tables, a summary with intervals, and two pictures."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from forestrl.evaluation.endings import Ending
from forestrl.evaluation.episodes import Episodes
from forestrl.evaluation.plots import coverage_png, interventions_png
from forestrl.paper import INTERVENTION_LIMIT
from forestrl.storage import atomic_write

LEVELS = (80, 90, 95, 98)
"""Coverages, %, whose first step is reported."""
CHECKPOINTS = (250, 500, 1000, 2000, 2500)
"""Steps whose coverage is reported, as far as the budget goes; the last step is always."""
AREAS = (500, 2500)
"""Steps up to which the area under the coverage curve is reported."""

_RESAMPLES, _SEED = 2000, 0


def write_report(
    episodes: Episodes,
    folder: str | os.PathLike[str],
    *,
    title: str,
    meta: Mapping[str, Any],
    paper: bool = True,
) -> dict[str, Any]:
    """Writes episodes.csv, curve.csv, summary.json, coverage.png and interventions.png.

    Args:
        episodes: what to report.
        folder: where to; made if it is not there.
        title: stands above the pictures and in the summary.
        meta: what else belongs in the summary, such as policy, seed and settings.
        paper: whether the paper's numbers, which hold for its own arenas, are marked in pictures.

    Returns:
        the summary.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    summary = {"title": title} | summarize(episodes) | {"meta": dict(meta)}
    atomic_write(folder / "episodes.csv", _csv(_episode_rows(episodes)))
    atomic_write(folder / "curve.csv", _csv(_curve_rows(episodes)))
    atomic_write(folder / "coverage.png", coverage_png(episodes, title=title, paper=paper))
    picture = interventions_png(episodes, title=title, paper=paper)
    atomic_write(folder / "interventions.png", picture)
    atomic_write(
        folder / "summary.json",
        json.dumps(summary, indent=2, ensure_ascii=False, default=str) + "\n",
    )
    return summary


def summarize(episodes: Episodes) -> dict[str, Any]:
    """Sums episodes up.

    A mean is given as ``{"mean", "low", "high"}`` with a 95 % percentile-bootstrap interval over
    arenas. Steps to a level are averaged over the arenas that got there, whose share stands beside.
    What cannot be known, such as an interval from one arena, is None.

    Returns:
        a dictionary that JSON can hold; coverages and rates are shares, not per cent.
    """
    steps, rate = episodes.steps, episodes.intervention_rate()
    marks = sorted({step for step in CHECKPOINTS if step < steps} | {steps})
    return {
        "arenas": len(episodes),
        "steps": steps,
        "coverage": {str(step): _mean(episodes.coverage[:, step]) for step in marks},
        "free_share": _mean(episodes.free_share),
        "steps_to": {str(level): _arrival(episodes.steps_to(level / 100)) for level in LEVELS},
        "area_under_curve": {
            str(upto): _mean(episodes.area_under_curve(upto)) for upto in AREAS if upto <= steps
        },
        "interventions": {
            "rate": _mean(rate),
            "percentile_80": float(np.percentile(rate, 80)),
            "share_under_15": float((rate < INTERVENTION_LIMIT).mean()),
        },
        "collisions": int(episodes.collisions.sum()),
        "null_actions": _mean(episodes.null_actions),
        "path_length": _mean(episodes.path_length),
        "truncated_graphs": int(episodes.truncated_graphs.sum()),
        "endings": {
            Ending(ending).name.lower(): float((episodes.ending == ending).mean())
            for ending in np.unique(episodes.ending)
        },
    }


def _mean(values: NDArray) -> dict[str, float | None]:
    """Mean and 95 % interval of one number an arena."""
    values = values.astype(np.float64)
    if len(values) == 0:
        return {"mean": None, "low": None, "high": None}
    if len(values) == 1:
        return {"mean": float(values[0]), "low": None, "high": None}
    interval = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=_RESAMPLES,
        batch=max(1, 10**6 // len(values)),  # memory
        method="percentile",
        random_state=_SEED,
    ).confidence_interval
    return {
        "mean": float(values.mean()),
        "low": float(interval.low),
        "high": float(interval.high),
    }


def _arrival(steps: NDArray) -> dict[str, float | None]:
    arrived = ~np.isnan(steps)
    return _mean(steps[arrived]) | {"reached": float(arrived.mean())}


def _episode_rows(episodes: Episodes) -> Iterable[Sequence[Any]]:
    areas = {upto: episodes.area_under_curve(upto) for upto in AREAS if upto <= episodes.steps}
    columns = {
        "index": episodes.index,
        "coverage": episodes.coverage[:, -1],
        **{f"coverage_{n}": episodes.coverage[:, n] for n in CHECKPOINTS if n <= episodes.steps},
        **{f"area_{upto}": area for upto, area in areas.items()},
        "free_share": episodes.free_share,
        **{f"steps_to_{level}": episodes.steps_to(level / 100) for level in LEVELS},
        "intervention_rate": episodes.intervention_rate(),
        "null_actions": episodes.null_actions,
        "collisions": episodes.collisions,
        "path_length": episodes.path_length,
        "ending": [Ending(ending).name.lower() for ending in episodes.ending],
    }
    return [tuple(columns), *zip(*columns.values(), strict=True)]


def _curve_rows(episodes: Episodes) -> Iterable[Sequence[Any]]:
    curve = episodes.mean_curve()
    return [("step", "mean", "low", "high"), *zip(range(episodes.steps + 1), *curve, strict=True)]


def _csv(rows: Iterable[Sequence[Any]]) -> str:
    """Rows as CSV text: floats with six digits, nan as nothing."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerows([_entry(value) for value in row] for row in rows)
    return buffer.getvalue()


def _entry(value: object) -> object:
    if isinstance(value, (float, np.floating)):
        return "" if math.isnan(value) else f"{value:.6g}"
    return value


def table(summary: Mapping[str, Any]) -> str:
    """Lays a summary out as plain text for the terminal.

    Args:
        summary: from :func:`write_report` or :func:`summarize`.
    """
    interventions = summary["interventions"]
    rows = [
        *((f"coverage at {n}", _percent(v)) for n, v in summary["coverage"].items()),
        ("all free cells", _percent(summary["free_share"])),
        *((f"steps to {n} %", _arrived(v)) for n, v in summary["steps_to"].items()),
        *((f"area, {n} steps", _percent(v)) for n, v in summary["area_under_curve"].items()),
        ("interventions", _percent(interventions["rate"])),
        ("  80 % of runs under", f"{100 * interventions['percentile_80']:6.1f} %"),
        ("  runs under 15 %", f"{100 * interventions['share_under_15']:6.1f} %"),
        ("null actions a run", _line(summary["null_actions"])),
        ("path length, cells", _line(summary["path_length"])),
        ("collisions", f"{summary['collisions']:6d}"),
    ]
    for ending, share in summary["endings"].items():
        rows.append((f"ended: {ending.replace('_', ' ')}", f"{100 * share:6.1f} % of runs"))
    if summary["truncated_graphs"]:
        rows.append(("graphs cut off", f"{summary['truncated_graphs']:6d}"))
    size = f"{summary['arenas']} arenas, {summary['steps']} steps; [95 % interval of the mean]"
    title = [summary["title"]] if "title" in summary else []
    return "\n".join([*title, size, *(f"{name:<22}{value}" for name, value in rows)])


def _line(mean: Mapping[str, Any], *, factor: float = 1, digits: int = 1, unit: str = "") -> str:
    """A mean with its unit and, if known, its interval."""
    text = f"{factor * mean['mean']:6.{digits}f} {unit:<1}"
    if mean["low"] is not None:
        text += f"  [{factor * mean['low']:.{digits}f}, {factor * mean['high']:.{digits}f}]"
    return text.rstrip()


def _percent(mean: Mapping[str, Any]) -> str:
    return _line(mean, factor=100, unit="%")


def _arrived(mean: Mapping[str, Any]) -> str:
    if mean["mean"] is None:
        return f"{'–':>6}    in no run"
    return f"{_line(mean, digits=0)}  in {100 * mean['reached']:.1f} % of runs"
