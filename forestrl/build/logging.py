"""The logger from the configuration."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from hydra.errors import InstantiationException
from hydra.utils import get_object, instantiate
from omegaconf import DictConfig, OmegaConf

from forestrl.build.errors import ConfigError
from forestrl.loggers import CsvLogger, Loggers, NoLogger, Run
from forestrl.records import MARK, began_with, is_sweep, setting
from forestrl.storage import atomic_write

_ID_FILE = "dashboard.txt"
_WANTED = ("log_metrics", "log_figure", "log_table", "log_policy", "close")


def make_logger(cfg: DictConfig, run_dir: Path, frames: int = 0) -> NoLogger | Loggers:
    """Builds the logger, which never ends the run; a CSV file is written beside every other one.

    The dashboard's id of the run is kept in the folder, so that a run that goes on is the same one.

    Args:
        cfg: the whole configuration.
        run_dir: the run folder.
        frames: frames the run goes on from.

    Raises:
        ConfigError: if the logger's target is not there or gives no logger. One that fails, as
            without a network, is left out with a line on standard error.
    """
    words, id_file = began_with(run_dir), run_dir / MARK / _ID_FILE
    config: Any = OmegaConf.to_container(cfg, resolve=True)
    run = Run(
        folder=run_dir,
        frames=frames,
        id=id_file.read_text().strip() if id_file.is_file() else None,
        config=config,
        command=HydraConfig.get().job.name,
        overrides=tuple(words),
        sweep=run_dir.parent if is_sweep(run_dir.parent) else None,
        experiment=next((w.partition("=")[2] for w in words if setting(w) == "experiment"), None),
    )
    chosen = _chosen(cfg.logger, run)
    if type(chosen) is NoLogger:
        return chosen
    if getattr(chosen, "id", None) and (run_dir / MARK).is_dir():
        atomic_write(id_file, f"{chosen.id}\n")
    alone = isinstance(chosen, CsvLogger)
    return Loggers(*([] if alone else [CsvLogger(run)]), *([] if chosen is None else [chosen]))


def _chosen(node: DictConfig, run: Run) -> Any:
    """The configuration's logger; None if it fails to begin."""
    get_object(node["_target_"])  # a name that is not there is an error, not a failure
    try:
        chosen = instantiate(node, run)
    except InstantiationException as error:
        cause = error.__cause__ or error
        if isinstance(cause, TypeError | ValueError):  # its settings
            raise
        words = f"{type(cause).__name__}: {' '.join(str(cause).split())}"
        print(f"{node['_target_']} failed and the run goes on: {words}", file=sys.stderr)
        return None
    missing = [name for name in _WANTED if not callable(getattr(chosen, name, None))]
    if missing:
        raise ConfigError(
            f"logger._target_={node['_target_']} gives {_said(chosen)}: a logger has "
            f"{missing[0]}, see docs/extend.md"
        )
    return chosen


def _said(thing: object) -> str:
    return "None" if thing is None else f"a {type(thing).__name__}"
