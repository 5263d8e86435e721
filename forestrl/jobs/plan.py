"""A robot's planner on standard input and output: ``forestrl plan``."""

from __future__ import annotations

import signal
import sys
from typing import Any

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig

from forestrl.planner.lines import Lines


def run(cfg: DictConfig) -> None:
    """Answers line by line until the input ends, or SIGTERM or SIGINT comes.

    A line that is being answered then is answered to its end.
    """
    torch.set_num_threads(cfg.threads)
    lines, busy, ended = Lines(instantiate(cfg.planner, _convert_="all")), False, False

    def end(*_: Any) -> None:
        nonlocal ended
        ended = True
        if not busy:
            raise SystemExit(0)

    before = {number: signal.signal(number, end) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        while not ended and (line := sys.stdin.readline()):
            if not line.strip():
                continue
            busy = True
            print(lines.answer(line), flush=True)
            busy = False
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
