"""The logger from the configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from forestrl.loggers import CsvLogger, Logger, Loggers, NoLogger, Run


def make_logger(
    cfg: DictConfig, run_dir: Path, frames: int = 0, logger_id: str | None = None
) -> Logger:
    """Builds the logger; a CSV file is written beside every other one.

    Args:
        cfg: the whole configuration.
        run_dir: the run folder.
        frames: frames the run goes on from.
        logger_id: the dashboard's id of the run that goes on.
    """
    job = HydraConfig.get()
    swept = job.mode is not None and job.mode.name == "MULTIRUN"
    config: Any = OmegaConf.to_container(cfg, resolve=True)
    run = Run(
        folder=run_dir,
        frames=frames,
        id=logger_id,
        config=config,
        command=job.job.name,
        overrides=tuple(job.overrides.task),
        sweep=Path(job.sweep.dir) if swept else None,
        experiment=job.runtime.choices.get("experiment"),
    )
    chosen = instantiate(cfg.logger, run)
    alone = isinstance(chosen, CsvLogger) or type(chosen) is NoLogger
    return chosen if alone else Loggers(CsvLogger(run), chosen)
