"""What a logger is told of a run, and what every logger does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol


@dataclass(frozen=True)
class Run:
    """What a logger is told of the run: its first argument, before its own settings."""

    folder: Path
    """The run folder."""
    frames: int = 0
    """Frames the run goes on from; 0 for a new one."""
    id: str | None = None
    """The dashboard's id of the run that goes on."""
    config: Mapping[str, Any] = field(default_factory=dict)
    """The resolved configuration."""
    command: str = "train"
    overrides: tuple[str, ...] = ()
    sweep: Path | None = None
    """The folder of the sweep whose job this is."""
    experiment: str | None = None


class Logger(Protocol):
    """What every logger does; ``step`` is counted in frames."""

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Takes scalars by name."""

    def log_figure(self, name: str, path: Path, step: int) -> None:
        """Takes a picture or an animation from a file."""

    def log_table(self, name: str, path: Path) -> None:
        """Takes a table from a CSV file."""

    def log_policy(self, path: Path, aliases: Sequence[str]) -> None:
        """Takes a policy file, to be found again by its aliases."""

    def close(self, failed: bool = False) -> None:
        """Ends the run."""


class NoLogger:
    """Writes nothing.

    Args:
        run: the run.
    """

    def __init__(self, run: Run | None = None) -> None: ...

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Ignores the metrics."""

    def log_figure(self, name: str, path: Path, step: int) -> None:
        """Ignores the picture."""

    def log_table(self, name: str, path: Path) -> None:
        """Ignores the table."""

    def log_policy(self, path: Path, aliases: Sequence[str]) -> None:
        """Ignores the policy."""

    def close(self, failed: bool = False) -> None:
        """Does nothing."""
