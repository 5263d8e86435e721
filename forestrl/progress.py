"""Progress of long work: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import statistics
import sys
import time
from types import TracebackType

from tqdm.auto import tqdm

_SHOWN = {
    "rollout/return": "return",
    "rollout/coverage": "coverage",
    "safety/intervention_rate": "interventions",
    "eval/steps": "steps",
}
_CUT_SHORT = "{} in training episodes, cut short at first; eval.every=0 measures no other"
_SECONDS_BETWEEN_LINES = 10


class Progress:
    """Shows how far a training is, with an estimate of the time left.

    Args:
        total: frames in all.
        start: frames done before.
        unit: what is counted, if not frames.
    """

    def __init__(self, total: int, start: int = 0, unit: str = "frame") -> None:
        self.total, self.done, self.unit = total, start, unit
        self.bar = tqdm(
            total=total,
            initial=start,
            unit=unit,
            unit_scale=True,
            smoothing=0.05,
            disable=not sys.stderr.isatty(),
        )
        self.began = self.last_line = time.monotonic()
        self.last_update = self.began
        self.paces: list[float] = []  # seconds a frame, of each update
        self.shown: dict[str, float] = {}

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.bar.close()

    def update(self, frames: int, metrics: dict[str, float]) -> None:
        """Shows that ``frames`` are done; a metric that is missing or nan keeps its last value."""
        now = time.monotonic()
        known = {n: metrics[key] for key, n in _SHOWN.items() if key in metrics}
        self.shown |= {name: value for name, value in known.items() if value == value}
        self.bar.set_postfix({name: f"{value:.3g}" for name, value in self.shown.items()}, False)
        self.bar.update(frames - self.done)
        self.paces.append((now - self.last_update) / max(frames - self.done, 1))
        self.done, self.last_update = frames, now
        if self.bar.disable and (
            now - self.last_line >= _SECONDS_BETWEEN_LINES or frames >= self.total
        ):
            self.last_line = now
            print(self._line(), file=sys.stderr, flush=True)

    def _line(self) -> str:
        pace = statistics.median(self.paces)  # what is compiled or evaluated once does not count
        left = (self.total - self.done) * pace
        shown = "  ".join(f"{name} {value:.3g}" for name, value in self.shown.items())
        return (
            f"{self.done:>9,} of {self.total:,} {self.unit}s  {self._pace(pace)}  "
            f"{_clock(left)} left  {shown}"
        )

    def _pace(self, seconds: float) -> str:
        rate = 1 / max(seconds, 1e-9)
        return f"{rate:,.0f} {self.unit}s/s" if rate >= 1 else f"{seconds:,.0f} s/{self.unit}"

    def summary(self, metrics: dict[str, float]) -> str:
        """Sums the training up in a short table."""
        rows = {
            "frames": f"{self.done:,}",
            "time": _clock(time.monotonic() - self.began),
            "interventions": self._value("interventions"),
            "coverage": _CUT_SHORT.format(self._value("coverage")),
        }
        if "eval/coverage" in metrics:
            rows["coverage"] = f"{metrics['eval/coverage']:.1%} in test arenas"
        width = max(map(len, rows))
        return "\n".join(f"  {name:<{width}}  {value}" for name, value in rows.items())

    def _value(self, name: str) -> str:
        return f"{self.shown[name]:.1%}" if name in self.shown else "no episode ended yet"


def _clock(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"
