"""Threads, device and output folder, before anything is built."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import torch
from omegaconf import DictConfig, OmegaConf

from forestrl.build.errors import ConfigError
from forestrl.kernels.sensing import are_compiled


def prepare(cfg: DictConfig) -> None:
    """Sets threads and checks the device, before anything is built."""
    require_positive(cfg, "threads")
    if cfg.seed < 0:
        raise ConfigError(f"seed={cfg.seed} is not allowed: it must be 0 or more")
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


def require_positive(cfg: DictConfig, *names: str) -> None:
    """Refuses settings less than 1."""
    for name in names:
        if (value := OmegaConf.select(cfg, name)) < 1:
            raise ConfigError(f"{name}={value} is not allowed: at least 1 is needed")


def make_output_folder(folder: Path) -> Path:
    """Makes a folder for results and checks that it can be written to."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".writable-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise ConfigError(f"the output folder {folder} cannot be written: {error}") from error
    return folder
