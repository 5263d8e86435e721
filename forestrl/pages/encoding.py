"""A recording as JSON, and back: changes instead of maps, whole numbers instead of decimals."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forestrl import functional as F
from forestrl.pages.recording import NOTHING, Considered, Moment, Recording
from forestrl.rendering.scene import Cell
from forestrl.status import Status

_COVERAGE, _SHARES, _SCORES = 5, 1000, 4  # decimals, parts of one, decimals
_COLUMNS = (
    *("changes", "agent", "coverage", "feasible", "proposed", "executed", "collided", "status"),
    *("probability", "waypoints", "viewpoints", "scores", "way"),
)
_NONE = -1
_VALUES = 4  # more than any value of a cell


def encode(recording: Recording) -> dict[str, Any]:
    """Writes a recording as JSON can hold it, a column for each of a moment's entries.

    Cells are numbered in row-major order. A change is ``4 * gap + value``, where ``gap`` is the
    distance to the change before it in the same step, or to cell -1. Coverage keeps five decimals,
    a probability is in thousandths.
    """
    rows, width = recording.trees.shape
    moments = recording.moments

    def number(cell: Cell) -> int:
        return cell[0] * width + cell[1]

    return {
        "rows": rows,
        "columns": width,
        "trees": _run_lengths(recording.trees.reshape(-1)),
        "lidar_range": recording.lidar_range,
        "coverage_goal": recording.coverage_goal,
        "filter": recording.has_filter,
        "graph": recording.has_graph,
        "changes": [_gaps(m.changed, m.values) for m in moments],
        "agent": [number(m.agent) for m in moments],
        "coverage": [round(m.coverage, _COVERAGE) for m in moments],
        "feasible": [sum(1 << i for i, free in enumerate(m.feasible) if free) for m in moments],
        "proposed": [_NONE if m.proposed is None else m.proposed for m in moments],
        "executed": [_NONE if m.executed is None else m.executed for m in moments],
        "collided": [int(m.collided) for m in moments],
        "status": [int(m.status) for m in moments],
        "probability": [
            m.probability and [round(_SHARES * share) for share in m.probability] for m in moments
        ],
        "waypoints": ["".join(map(str, m.waypoints.tolist())) for m in moments],
        "viewpoints": [[number(cell) for cell in m.considered.cells] for m in moments],
        "scores": [[round(each, _SCORES) for each in m.considered.scores] for m in moments],
        "way": [[number(cell) for cell in m.considered.way] for m in moments],
    }


def decode(data: dict[str, Any]) -> Recording:
    """Reads a recording back; what was rounded stays so."""
    shape = data["rows"], data["columns"]
    columns = [data[name] for name in _COLUMNS]
    trees = np.repeat(np.arange(len(data["trees"])) % 2 == 1, data["trees"])
    return Recording(
        trees=trees.reshape(shape),
        lidar_range=data["lidar_range"],
        coverage_goal=data["coverage_goal"],
        has_filter=data["filter"],
        has_graph=data["graph"],
        moments=tuple(_moment(shape[1], *entries) for entries in zip(*columns, strict=True)),
    )


def _moment(width: int, *entries: Any) -> Moment:
    changes, agent, coverage, feasible, proposed, executed, collided, status = entries[:8]
    probability, waypoints, viewpoints, scores, way = entries[8:]

    def cells(numbers: Sequence[int]) -> tuple[Cell, ...]:
        return tuple(divmod(number, width) for number in numbers)

    gaps, values = np.divmod(np.array(changes, np.int64), _VALUES)
    considered = Considered(cells(viewpoints), tuple(scores), cells(way))
    return Moment(
        changed=np.cumsum(gaps) - 1,
        values=values.astype(np.uint8),
        agent=divmod(agent, width),
        coverage=coverage,
        feasible=tuple(bool(feasible >> i & 1) for i in range(len(F.DISPLACEMENTS))),
        proposed=None if proposed == _NONE else proposed,
        executed=None if executed == _NONE else executed,
        collided=bool(collided),
        status=Status(status),
        probability=probability and tuple(part / _SHARES for part in probability),
        waypoints=np.array(list(waypoints), np.uint8),
        considered=considered if viewpoints or way else NOTHING,
    )


def _gaps(changed: NDArray[np.int64], values: NDArray[np.uint8]) -> list[int]:
    return (_VALUES * np.diff(changed, prepend=-1) + values).tolist()


def _run_lengths(flags: NDArray[np.bool_]) -> list[int]:
    """Counts how many False come first, then how many True, and so on.

    >>> _run_lengths(np.array([True, True, False]))
    [0, 2, 1]
    """
    ends = [0, *(np.flatnonzero(flags[1:] != flags[:-1]) + 1).tolist(), len(flags)]
    runs = [end - start for start, end in pairwise(ends)]
    return [0, *runs] if flags[0] else runs
