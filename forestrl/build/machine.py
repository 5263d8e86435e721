"""Threads and device, before anything is built."""

from __future__ import annotations

import sys

import torch
from omegaconf import DictConfig

from forestrl.build.errors import ConfigError
from forestrl.kernels.sensing import are_compiled


def prepare(cfg: DictConfig) -> None:
    """Sets threads and checks the device, before anything is built."""
    torch.set_num_threads(cfg.threads)
    if not are_compiled():
        print("compiling for this machine: half a minute, the first time only", file=sys.stderr)
    try:
        torch.zeros(1, device=cfg.device)
    except (RuntimeError, AssertionError) as error:
        there = ["cpu", *(f"cuda:{i}" for i in range(torch.cuda.device_count()))]
        raise ConfigError(
            f"device={cfg.device} is not there: this machine has {', '.join(there)}"
        ) from error
