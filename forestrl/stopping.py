"""Stopping politely: a signal ends the work where it can be gone on with.

SLURM and ``timeout`` send SIGTERM, a terminal SIGINT (Ctrl-C) or, when it closes, SIGHUP.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

_asked: list[int] = []
"""The signal that asked this process to stop, if one did."""


class Stopped(BaseException):
    """Raised wherever the program is when a signal asks it to stop.

    Attributes:
        number: of the signal.
        how_to_go_on: a command, for the last line that the program prints; may be set on the way.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number, self.how_to_go_on = number, ""

    @property
    def status(self) -> int:
        """The exit status that shells give: 130 for SIGINT, 143 for SIGTERM, 129 for SIGHUP."""
        return 128 + self.number

    def __str__(self) -> str:
        """Says what happened and how to go on, in one line."""
        line = f"stopped by {signal.Signals(self.number).name}"
        return line + (f", saved; to go on: {self.how_to_go_on}" if self.how_to_go_on else "")


@contextmanager
def stopping() -> Iterator[None]:
    """Lets signals raise :class:`Stopped` in this block; one that is ignored stays ignored.

    Further signals are ignored until :func:`saved`, so that what is saved is saved whole.
    """
    before: dict[int, Any] = {}
    _asked.clear()
    try:
        for number in _SIGNALS:
            if signal.getsignal(number) != signal.SIG_IGN:  # as nohup has it
                before[int(number)] = signal.signal(number, _stop)
    except ValueError:  # not in the main thread, which alone may listen
        pass
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def check() -> None:
    """Raises :class:`Stopped` if it was raised before where nobody could hand it on."""
    if _asked:
        raise Stopped(_asked[0])


def saved() -> None:
    """Says that nothing is left to be saved: once asked to stop, a further signal ends it."""
    for number in _SIGNALS:
        if _asked and signal.getsignal(number) == _stop:
            signal.signal(number, signal.SIG_DFL)


def _stop(number: int, frame: FrameType | None) -> None:
    if not _asked:
        _asked.append(number)
        raise Stopped(number)
