"""The benchmark as a table for the terminal, ``bench.txt``, ``bench.csv`` and ``machine.json``."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from forestrl.benchmark.rows import Row
from forestrl.benchmark.stages import DECISION, ITERATION, MAP_DECISION, SAFE_DECISION
from forestrl.storage import atomic_write

_DECISIONS = (DECISION, SAFE_DECISION, MAP_DECISION)
_NAME, _CELL = 18, 15  # widths of columns


def write_report(rows: Sequence[Row], about: Mapping[str, str], folder: Path) -> str:
    """Writes the table and what it was made from.

    Args:
        rows: all that was measured.
        about: machine, threads, versions and settings.
        folder: where to.

    Returns:
        the table.
    """
    text = table(rows, about)
    names = [field.name for field in fields(Row)]
    atomic_write(folder / "bench.csv", to_csv(names, map(asdict, rows)))
    atomic_write(folder / "machine.json", json.dumps(dict(about), indent=2) + "\n")
    atomic_write(folder / "bench.txt", text + "\n")
    return text


def to_csv(names: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """Lays rows out as CSV: floats with six digits, None as nothing."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})
    return buffer.getvalue()


def table(rows: Sequence[Row], about: Mapping[str, str]) -> str:
    """Lays the benchmark out as plain text.

    Args:
        rows: all that was measured.
        about: machine, threads, versions and settings.
    """
    parts = ["\n".join(f"{name:<{_NAME}}{value}" for name, value in about.items())]
    for size in sorted({row.size for row in rows}):
        parts += _blocks([row for row in rows if row.size == size])
    return "\n\n".join([*parts, _notes(rows)])


def _blocks(rows: Sequence[Row]) -> list[str]:
    """Lays one size out: speed, shares, memory and decisions."""
    first = rows[0]
    cells = {(row.stage, row.num_envs): row for row in rows if row.stage not in _DECISIONS}
    names = list(dict.fromkeys(stage for stage, _ in cells))
    arenas = sorted({n for _, n in cells})
    head = (
        f"arenas of {first.size} x {first.size} cells, {first.n_trees} trunks; states with "
        f"{first.coverage:.0%} coverage and {first.frontiers:.0f} frontier cells on average"
    )
    speed = [_line(name, (_speed(cells[name, n]) for n in arenas)) for name in names]
    shares = [
        _line(name, (_share(cells[name, n]) for n in arenas))
        for name in names
        if any(cells[name, n].share is not None for n in arenas)
    ]
    if shares:
        whole = (_whole(cells, n) for n in arenas)
        shares.append(_line("whole iteration", whole))
    peaks = (max(r.peak_memory_gb or 0.0 for (_, m), r in cells.items() if m == n) for n in arenas)
    memory = _line("peak memory, GB", (f"{peak:.2f}" for peak in peaks))
    top = _line("arenas at once", map(str, arenas))
    blocks = [head, "\n".join(["frames/s", top, *speed, memory])]
    if shares:
        blocks.append("\n".join(["microseconds added to a frame, share", top, *shares]))
    decisions = [_decision(row) for row in rows if row.stage in _DECISIONS]
    return [*blocks, "\n".join(["one decision", *decisions])]


def _line(name: str, values: Iterable[str]) -> str:
    return f"{name:<{_NAME}}" + "".join(f"{value:>{_CELL}}" for value in values)


def _speed(row: Row) -> str:
    if row.frames_per_second is None:
        return "skipped"
    return f"{'~' * (row.how == 'estimated')}{row.frames_per_second:,.0f}"


def _share(row: Row) -> str:
    if row.share is None or row.added is None:
        return "-"
    return f"{1e6 * row.added:,.1f} {row.share:>6.1%}"


def _whole(cells: Mapping[tuple[str, int], Row], arenas: int) -> str:
    """Compares an iteration's time a frame with the sum of the pipeline's stages."""
    speed = cells[ITERATION, arenas].frames_per_second
    total = sum(row.added or 0.0 for (_, n), row in cells.items() if n == arenas)
    return f"{1e6 / speed:,.1f} {1 / speed / total:>6.0%}" if speed and total else "-"


def _decision(row: Row) -> str:
    median, tail = 1e3 * (row.seconds or 0.0), 1e3 * (row.percentile_99 or 0.0)
    return f"{row.stage:<{_NAME}}median {median:.3f} ms, 99th percentile {tail:.3f} ms"


def _notes(rows: Sequence[Row]) -> str:
    notes = [
        "In frames/s an env stage includes those above it; in shares a minibatch counts once an",
        "epoch. The whole iteration has the collector, resets and bookkeeping too; its share is of",
        "the sum of the stages. Memory is the process's peak so far, small batches before large.",
    ]
    if any(row.how == "estimated" for row in rows):
        notes.append("~ estimated: one minibatch times their number, and GAE, for the update.")
    if reasons := sorted({row.how for row in rows if row.how.startswith("skipped")}):
        numbers = sorted({row.num_envs for row in rows if row.how in reasons})
        notes.append(f"num_envs {', '.join(map(str, numbers))}: {'; '.join(reasons)}.")
    return "\n".join(notes)
