"""Writes an evaluation down: tables, a summary with intervals, and two pictures."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from forestrl.evaluation.endings import Ending
from forestrl.evaluation.episodes import Episodes
from forestrl.evaluation.plots import coverage_png, interventions_png
from forestrl.paper import COVERAGE, INTERVENTION_LIMIT
from forestrl.statistics import Interval, mean_interval
from forestrl.storage import atomic_write, csv_text

LEVELS = (80, 90, 95, 98)
"""Coverages, %, whose first step is reported."""
CHECKPOINTS = (250, 500, 1000, 2000, 2500)
"""Steps whose coverage is reported, as far as the budget goes; the last step is always."""
AREAS = (500, 2500)
"""Steps up to which the area under the coverage curve is reported."""
_EVERY = 10  # steps between the rows of curve.csv


def write_report(
    episodes: Episodes,
    folder: str | os.PathLike[str],
    *,
    title: str,
    meta: Mapping[str, Any],
    paper: Mapping[int, float] | None = None,
) -> dict[str, Any]:
    """Writes episodes.csv, curve.csv, summary.json, coverage.png and interventions.png.

    Args:
        episodes: what to report.
        folder: where to; made if it is not there.
        title: stands above the pictures and in the summary.
        meta: what else belongs in the summary, such as policy, seed and settings. Without its
            ``filter`` nothing is said of interventions.
        paper: the paper's own coverage for this policy in these arenas, by step, for the pictures;
            if that is of its learned policy, interventions have its numbers too.

    Returns:
        the summary.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    summary = {"title": title} | summarize(episodes) | {"meta": dict(meta)}
    atomic_write(folder / "episodes.csv", csv_text(_episode_rows(episodes)))
    atomic_write(folder / "curve.csv", csv_text(_curve_rows(episodes)))
    atomic_write(folder / "coverage.png", coverage_png(episodes, title=title, paper=paper or {}))
    if meta.get("filter", True):
        picture = interventions_png(episodes, title=title, paper=paper == COVERAGE)
        atomic_write(folder / "interventions.png", picture)
    text = json.dumps(summary, indent=1, ensure_ascii=False, default=str)
    atomic_write(folder / "summary.json", text + "\n")
    return summary


def summarize(episodes: Episodes) -> dict[str, Any]:
    """Sums episodes up in long form: a row a measure.

    A mean has a 95 % percentile-bootstrap interval over arenas and the number of arenas that count:
    for steps to a level those that got there, whose share is a measure of its own. A count or a
    share has no interval, nor has a mean over one arena; a mean over none is None.

    Returns:
        a dictionary that JSON can hold: ``arenas``, ``steps``, and ``measures``, a list of
        ``{"measure", "mean", "low", "high", "n"}``. Coverages and rates are shares, not per cent.
    """
    rows = [
        {"measure": name, "mean": mean, "low": low, "high": high, "n": n}
        for name, (mean, low, high), n in _measures(episodes)
    ]
    blank = [{key: _known(value) for key, value in row.items()} for row in rows]
    return {"arenas": len(episodes), "steps": episodes.steps, "measures": blank}


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and math.isnan(value) else value


def _measures(episodes: Episodes) -> Iterator[tuple[str, Interval, int]]:
    """Every measure with its interval and the number of arenas behind it."""
    steps, rate, arenas = episodes.steps, episodes.intervention_rate(), len(episodes)

    def over(name: str, values: Any) -> tuple[str, Interval, int]:
        count = int((~np.isnan(np.asarray(values, float))).sum())
        return name, mean_interval(values) or Interval(math.nan), count

    for step in sorted({step for step in CHECKPOINTS if step < steps} | {steps}):
        yield over(f"coverage_{step}", episodes.coverage[:, step])
    yield over("free_share", episodes.free_share)
    for level in LEVELS:
        arrival = episodes.steps_to(level / 100)
        yield over(f"steps_to_{level}", arrival)
        yield f"reached_{level}", Interval(float((~np.isnan(arrival)).mean())), arenas
    for upto in AREAS:
        if upto <= steps:
            yield over(f"area_{upto}", episodes.area_under_curve(upto))
    yield over("intervention_rate", rate)
    for name, value in (
        ("percentile_80", np.percentile(rate, 80)),
        ("share_under_15", (rate < INTERVENTION_LIMIT).mean()),
        ("collisions", episodes.collisions.sum()),
    ):
        yield name, Interval(float(value)), arenas
    yield over("null_actions", episodes.null_actions)
    yield over("path_length", episodes.path_length)
    yield "guarded", Interval(float(episodes.guarded.sum())), arenas
    yield "truncated_graphs", Interval(float(episodes.truncated_graphs.sum())), arenas
    for ending in np.unique(episodes.ending):
        share = float((episodes.ending == ending).mean())
        yield f"ended_{Ending(ending).name.lower()}", Interval(share), arenas


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
        "guarded": episodes.guarded,
        "path_length": episodes.path_length,
        "ending": [Ending(ending).name.lower() for ending in episodes.ending],
    }
    return [tuple(columns), *zip(*columns.values(), strict=True)]


def _curve_rows(episodes: Episodes) -> Iterable[Sequence[Any]]:
    """The mean coverage at every tenth step and the last."""
    rows = list(zip(range(episodes.steps + 1), *episodes.mean_curve(), strict=True))
    last = [] if episodes.steps % _EVERY == 0 else [rows[-1]]
    return [("step", "mean", "low", "high"), *rows[::_EVERY], *last]


_WORDS = {
    "free_share": ("all free cells", 100, 1, "%"),
    "intervention_rate": ("interventions, of all steps", 100, 1, "%"),
    "percentile_80": ("  80 % of runs have under", 100, 1, "%"),
    "share_under_15": ("  runs that have under 15 %", 100, 1, "%"),
    "null_actions": ("steps in place, a run", 1, 1, ""),
    "path_length": ("way gone, cells", 1, 1, ""),
    "collisions": ("collisions", 1, 0, ""),
    "guarded": ("steps of the guard", 1, 0, ""),
    "truncated_graphs": ("observations cut off*", 1, 0, ""),
}
_CUT_OFF = "* more frontier cells than graph.max_frontiers: the nearest were kept"


def table(summary: Mapping[str, Any]) -> str:
    """Lays a summary out as plain text for the terminal.

    Args:
        summary: from :func:`write_report` or :func:`summarize`.
    """
    rows = {row["measure"]: row for row in summary["measures"]}
    size = f"{summary['arenas']} arenas, {summary['steps']} steps; [95 % interval of the mean]"
    lines = [*([summary["title"]] if "title" in summary else []), size]
    filtered = summary.get("meta", {}).get("filter", True)
    for name, row in rows.items():
        left_out = name in ("guarded", "truncated_graphs") and not row["mean"]
        left_out |= not filtered and name in (
            "intervention_rate",
            "percentile_80",
            "share_under_15",
        )
        if not left_out and not name.startswith("reached_"):
            label, value = _line(name, row, rows)
            lines.append(f"{label:<29}{value}")
    if rows["truncated_graphs"]["mean"]:
        lines.append(_CUT_OFF)
    return "\n".join(lines)


def _line(name: str, row: Mapping[str, Any], rows: Mapping[str, Any]) -> tuple[str, str]:
    """What a measure is called, and its value."""
    kind, _, level = name.rpartition("_")
    if kind == "coverage":
        return f"coverage at {level} steps", _value(row, 100, 1, "%")
    if kind == "area":
        return f"mean coverage to step {level}", _value(row, 100, 1, "%")
    if kind == "steps_to":
        reached = f"  in {100 * rows[f'reached_{level}']['mean']:.1f} % of runs"
        value = f"{'–':>7}" if row["mean"] is None else _value(row, 1, 0, "")
        return f"steps to {level} % coverage", value + reached
    if name.startswith("ended_"):
        label = name.removeprefix("ended_").replace("_", " ")
        return f"ended: {label}", f"{100 * row['mean']:7.1f} % of runs"
    label, factor, digits, unit = _WORDS[name]
    return label, _value(row, factor, digits, unit)


def _value(row: Mapping[str, Any], factor: float, digits: int, unit: str) -> str:
    """A mean with its unit and, if known, its interval."""
    text = f"{factor * row['mean']:7.{digits}f} {unit}".rstrip()
    if row["low"] is not None:
        text += f"  [{factor * row['low']:.{digits}f}, {factor * row['high']:.{digits}f}]"
    return text
