"""Tables in Markdown, of numbers with their intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from tabulate import tabulate

from forestrl.statistics import Interval


class Column(NamedTuple):
    """A column of numbers: what is measured, and how it is written."""

    head: str
    measure: str
    factor: float = 100.0
    digits: int = 1
    best: Callable[..., float] = max

    def cell(self, interval: Interval | None) -> str:
        """Writes a mean and the larger side of its interval."""
        if interval is None or math.isnan(interval.mean):
            return "–"
        if interval.mean == interval.margin == 0 or (
            interval.mean == 0 and math.isnan(interval.margin)
        ):
            return "0"
        text = f"{self.factor * interval.mean:.{self.digits}f}"
        if not math.isnan(interval.margin):
            text += f" ± {self.factor * interval.margin:.{self.digits}f}"
        return text

    def given(self, interval: Interval | None) -> str:
        """Writes a number with no more digits than its source has."""
        if interval is None or not math.isnan(interval.margin):
            return self.cell(interval)
        return f"{round(self.factor * interval.mean, self.digits):g}"


ARRIVAL = Column("steps to 98 %", "steps_to_98", 1.0, 0, min)


def signed(number: float, digits: int = 1) -> str:
    """Writes a number with its sign."""
    return f"{number:+.{digits}f}".replace("-", "−")


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Writes a Markdown table, its first column to the left and the others to the right."""
    align = ["left", *["right"] * (len(head) - 1)]
    return tabulate(rows, head, "pipe", disable_numparse=True, colalign=align) + "\n"
