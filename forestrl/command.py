"""What all commands share: Hydra's entry, and errors in one line."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException, InstantiationException
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from forestrl.config import CONF_DIR

_USER_ERRORS = (ValueError, OSError, HydraException, OmegaConfBaseException)


def command(name: str) -> Callable[[Callable[[DictConfig], Any]], Callable[[], Any]]:
    """Makes a function of the configuration a command.

    An error in the settings, a file or a checkpoint ends the command with one line on standard
    error and exit status 1; ``debug=true`` (or ``HYDRA_FULL_ERROR=1``) shows the traceback. In a
    sweep the other jobs still run.

    Args:
        name: the command's name, and that of its primary configuration.
    """

    def decorate(function: Callable[[DictConfig], Any]) -> Callable[[], Any]:
        @wraps(function)
        def job(cfg: DictConfig) -> Any:
            try:
                return function(cfg)
            except _USER_ERRORS as error:
                if _debug() or HydraConfig.get().mode == RunMode.MULTIRUN:
                    raise
                _fail(name, error)

        entry = hydra.main(config_path=CONF_DIR, config_name=name, version_base="1.3")(job)

        @wraps(function)
        def main() -> Any:
            if _debug():
                os.environ["HYDRA_FULL_ERROR"] = "1"
                return entry()
            os.environ["HYDRA_FULL_ERROR"] = "1"  # errors reach the line below instead of a print
            try:
                return entry()
            except _USER_ERRORS as error:
                _fail(name, error)
            finally:
                del os.environ["HYDRA_FULL_ERROR"]

        return main

    return decorate


def asked_for() -> set[str]:
    """Names the settings given on the command line or by the sweep, without their values."""
    overrides = HydraConfig.get().overrides.task
    return {override.lstrip("+~").partition("=")[0] for override in overrides}


def _debug() -> bool:
    given = os.environ.get("HYDRA_FULL_ERROR") == "1"
    return given or any(argument.lower() == "debug=true" for argument in sys.argv)


def _fail(name: str, error: BaseException) -> None:
    """Prints an error in one line and ends the program with status 1."""
    print(f"forestrl {name}: {describe(error)}", file=sys.stderr)
    sys.exit(1)


def describe(error: BaseException) -> str:
    """Puts an error into one line, from its first cause."""
    while isinstance(error, InstantiationException) and error.__cause__ is not None:
        error = error.__cause__
    text = " ".join(str(error).split())
    if unknown := re.search(r"Could not override '([^']+)'", text):
        return f"there is no setting '{unknown[1]}': see `--cfg job` for all settings"
    return text
