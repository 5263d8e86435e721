"""What all commands share: Hydra's entry, and errors in one line."""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any

import hydra
from hydra import compose
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException, InstantiationException
from hydra.types import RunMode
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from forestrl.config import CONF_DIR

_USER_ERRORS = (ValueError, OSError, HydraException, OmegaConfBaseException)
_SWEEP_FLAGS = ("-m", "--multirun")
_KINDS = {int: "a whole number", float: "a number", bool: "true or false", ListConfig: "a list"}
_FULL_ERROR = os.environ.get("HYDRA_FULL_ERROR") == "1"  # as the user set it; main() sets it too


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
                _check_kinds(cfg)
                return function(cfg)
            except _USER_ERRORS as error:
                if _debug() or HydraConfig.get().mode == RunMode.MULTIRUN:
                    raise
                _fail(name, error)

        entry = hydra.main(config_path=CONF_DIR, config_name=name, version_base="1.3")(job)

        @wraps(function)
        def main() -> Any:
            # Hydra takes all settings before the flag or all after it, not some of each
            sys.argv[1:] = sorted(sys.argv[1:], key=lambda word: word not in _SWEEP_FLAGS)
            os.environ["HYDRA_FULL_ERROR"] = "1"  # errors reach the line below instead of a print
            try:
                return entry()
            except _USER_ERRORS as error:
                if _debug():
                    raise
                _fail(name, error)
            finally:
                del os.environ["HYDRA_FULL_ERROR"]

        return main

    return decorate


def asked_for() -> set[str]:
    """Names the settings given on the command line or by the sweep, without their values."""
    return {_setting(override) for override in HydraConfig.get().overrides.task}


def _setting(override: str) -> str:
    return override.lstrip("+~").partition("=")[0]


def _check_kinds(cfg: DictConfig) -> None:
    """Refuses a setting of another kind than its default's, such as ``env.size=large``."""
    job = HydraConfig.get()
    groups = [text for text in job.overrides.task if _setting(text) in job.runtime.choices]
    defaults = compose(job.job.config_name, groups)
    for name in sorted(asked_for()):
        given, default = OmegaConf.select(cfg, name), OmegaConf.select(defaults, name)
        if not _same_kind(given, default):
            kind = _KINDS[type(default)]
            raise ValueError(f"{name}={given} is not allowed: it must be {kind}, such as {default}")


def _same_kind(given: Any, default: Any) -> bool:
    if isinstance(default, ListConfig):
        return isinstance(given, ListConfig) and all(_same_kind(each, default[0]) for each in given)
    if isinstance(default, float):
        return type(given) in (int, float) and math.isfinite(given)
    return type(default) not in _KINDS or type(given) is type(default)


def _debug() -> bool:
    return _FULL_ERROR or any(argument.lower() == "debug=true" for argument in sys.argv)


def _fail(name: str, error: BaseException) -> None:
    """Prints an error in one line and ends the program with status 1."""
    print(f"forestrl {name}: {describe(error)}", file=sys.stderr)
    sys.exit(1)


def describe(error: BaseException) -> str:
    """Puts an error into one line, from its first cause."""
    while isinstance(error, InstantiationException) and error.__cause__ is not None:
        error = error.__cause__
    text = " ".join(str(error).split()).partition(" Config search path:")[0]
    if unknown := re.search(r"Could not override '([^']+)'", text):
        return f"there is no setting '{unknown[1]}': see `--cfg job` for all settings"
    return text
