"""Several loggers as one, none of which can end the run."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from forestrl.loggers.run import Logger


class Loggers:
    """Passes everything on to several loggers; a logger that fails does not end the run.

    The first failure of each is said in one line on standard error; it is tried again the next
    time, as a disk may have room or a network may be back by then.

    Args:
        loggers: to pass on to.
    """

    def __init__(self, *loggers: Logger) -> None:
        self.loggers = loggers
        self._failed: set[int] = set()

    @property
    def id(self) -> str | None:
        """The dashboard's id of the run, to go on with it; None without a dashboard."""
        return next((logger.id for logger in self.loggers if hasattr(logger, "id")), None)

    def log_metrics(self, metrics: dict[str, float], step: int) -> None:
        """Passes the metrics on."""
        self._tell("log_metrics", metrics, step)

    def log_figure(self, name: str, path: Path, step: int) -> None:
        """Passes the picture on."""
        self._tell("log_figure", name, path, step)

    def log_table(self, name: str, path: Path) -> None:
        """Passes the table on."""
        self._tell("log_table", name, path)

    def log_policy(self, path: Path, aliases: Sequence[str]) -> None:
        """Passes the policy on."""
        self._tell("log_policy", path, aliases)

    def close(self, failed: bool = False) -> None:
        """Closes all."""
        self._tell("close", failed)

    def _tell(self, method: str, *arguments: Any) -> None:
        for number, logger in enumerate(self.loggers):
            try:
                getattr(logger, method)(*arguments)
            except Exception as error:  # whatever a user's logger or a library raises
                if number not in self._failed:
                    self._failed.add(number)
                    print(
                        f"{type(logger).__name__} failed and the run goes on: {method}: "
                        f"{type(error).__name__}: {' '.join(str(error).split())}",
                        file=sys.stderr,
                    )
