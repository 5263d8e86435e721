"""Metrics as a CSV file, which survives torn rows and a full disk."""

from __future__ import annotations

import csv
import io
import math
import sys
from pathlib import Path

from forestrl.loggers.run import NoLogger, Run
from forestrl.storage import atomic_write

METRICS_FILE = "metrics.csv"

_FIRST = "frames"
_END = "\n"


class CsvLogger(NoLogger):
    """Writes ``metrics.csv``, a row a call, the first column the frames.

    A metric that appears later adds a column; a value that is missing or nan is left empty. Going
    on with a run keeps its rows up to the point where it goes on, but for those that are damaged,
    as by a crash of the machine: these are counted on standard error. Rows that could not be
    written, as on a full disk, are written with the next one.

    Args:
        run: gives the folder, and the frames that the run goes on from.
    """

    def __init__(self, run: Run) -> None:
        self.path = run.folder / METRICS_FILE
        self.columns: list[str] = [_FIRST]
        self.rows: list[dict[str, str]] = []
        if run.frames and self.path.exists():
            self.columns, self.rows, damaged = read_rows(self.path, run.frames)
            if damaged:
                print(f"{self.path}: left out {damaged} damaged", file=sys.stderr)
        self._whole = False
        self._rewrite()

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Appends a row."""
        row = {name: f"{value:.6g}" for name, value in metrics.items() if value == value}
        self.rows.append({_FIRST: str(step), **row})
        new = [name for name in metrics if name not in self.columns]
        self.columns += new
        if new or not self._whole:
            self._rewrite()
            return
        self._whole = False
        with self.path.open("a", newline="") as file:
            csv.DictWriter(file, self.columns, restval="").writerow(self.rows[-1])
        self._whole = True

    def close(self, failed: bool = False) -> None:
        """Writes what could not be written before."""
        if not self._whole:
            self._rewrite()

    def _rewrite(self) -> None:
        self._whole = False
        table = io.StringIO(newline="")
        writer = csv.DictWriter(table, self.columns, restval="")
        writer.writeheader()
        writer.writerows(self.rows)
        atomic_write(self.path, table.getvalue())
        self._whole = True


def read_rows(path: Path, frames: float = math.inf) -> tuple[list[str], list[dict[str, str]], str]:
    """Reads the rows of a metrics file up to a number of frames.

    Args:
        path: the file, as :class:`CsvLogger` wrote it or as a crash left it.
        frames: those of the last row to be read.

    Returns:
        the columns, the whole rows by column, and what else was there, in words: a row without its
        end, with a cell too few or one that is no number, or not behind the row before it.
    """
    text = path.read_bytes().decode(errors="replace")
    head, *lines = text.splitlines(keepends=True) or [""]
    columns = next(csv.reader([head]), [])
    if columns[:1] != [_FIRST] or not head.endswith(_END) or len({*columns}) < len(columns):
        return [_FIRST], [], "rows, as its first line is"
    rows: list[dict[str, str]] = []
    damaged, last = 0, -1
    for line in lines:
        step = _step(line, len(columns))
        if step is not None and step > frames:
            break
        if step is None or step <= last:
            damaged += 1
            continue
        last = step
        rows.append(dict(zip(columns, next(csv.reader([line])), strict=True)))
    words = f"{damaged} row{'s' * (damaged > 1)}, which" + (" were" if damaged > 1 else " was")
    return columns, rows, words if damaged else ""


def _step(line: str, columns: int) -> int | None:
    """The frames of a row; None if it is not whole."""
    try:
        (cells,) = csv.reader([line])
        [float(cell) for cell in cells if cell]
        step = int(cells[0])
    except (ValueError, IndexError):
        return None
    return step if line.endswith(_END) and len(cells) == columns else None
