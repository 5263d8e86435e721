"""What all commands share: Hydra's entry, settings checked before the work, errors in one line."""

from __future__ import annotations

import os
import shlex
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from pathlib import Path
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from hydra.utils import to_absolute_path
from omegaconf import DictConfig, OmegaConf

from forestrl import records, runs
from forestrl.command_line import prepare_words, typed
from forestrl.config import CONF_DIR, check_all, kinds_of, leaves
from forestrl.errors import describe, is_users, with_whole_names
from forestrl.settings import is_path
from forestrl.stopping import Stopped, saved, stopping
from forestrl.terminal import lasting_output

_FULL_ERROR = os.environ.get("HYDRA_FULL_ERROR") == "1"  # as the user set it; main() sets it too

Job = Callable[[DictConfig], Any]


def command(name: str, settings: Any = None) -> Callable[[Job], Callable[[], Any]]:
    """Makes a function of the configuration a command.

    The whole configuration is checked before the function is called. An error in the settings, a
    file or a checkpoint ends the command with one line on standard error and exit status 1;
    ``debug=true`` (or ``HYDRA_FULL_ERROR=1``) shows the traceback. In a sweep the other jobs still
    run.

    Args:
        name: the command's name, and that of its primary configuration.
        settings: a dataclass whose annotated fields say what the configuration may hold besides
            what the classes in it take.
    """

    def decorate(function: Job) -> Callable[[], Any]:
        @wraps(function)
        def job(cfg: DictConfig) -> Any:
            check_all(cfg, settings, asked_for())
            if HydraConfig.get().job.chdir:
                cfg = _with_absolute_paths(cfg, settings)
            try:
                return _once(function, cfg)
            except (MemoryError, RuntimeError) as error:
                if "alloc" not in str(error):
                    raise
                raise ValueError(
                    f"not enough memory for arenas so large or many: {error}"
                ) from error

        entry = hydra.main(config_path=CONF_DIR, config_name=name, version_base="1.3")(
            _in_one_line(name, job)
        )

        def started() -> Any:
            prepare_words(name, settings)
            return entry()

        @wraps(function)
        def main() -> Any:
            with lasting_output(), stopping():
                return _run(name, started)

        return main

    return decorate


def _once(function: Job, cfg: DictConfig) -> Any:
    """Calls a job, but for one of a sweep that is finished, and notes that it is."""
    folder = Path(HydraConfig.get().runtime.output_dir)
    if _is_swept() and (done := records.finished(folder)) is not None:
        print(f"{folder}: finished, there is nothing left to do")
        return done["result"]
    result = function(cfg)
    records.mark_finished(run_folder(cfg), result)
    return result


def _in_one_line(name: str, job: Job) -> Job:
    """Ends the program where a job fails; in a sweep the others go on."""

    @wraps(job)
    def wrapped(cfg: DictConfig) -> Any:
        try:
            return job(cfg)
        except Stopped as stopped:
            if "resume" in cfg and not _is_swept() and runs.has_worth(run_folder(cfg)):
                stopped.how_to_go_on = f"forestrl {name} {typed('resume', run_folder(cfg))}"
            raise
        except Exception as error:
            user_error = is_users(error) and not _debug()
            text = with_whole_names(describe(error), cfg)
            if _is_swept():
                _note(text if user_error else "".join(traceback.format_exception(error)))
            if not user_error:
                raise
            if _is_swept():
                raise ValueError(text) from error
            _fail(name, text)  # Hydra would say more about it

    return wrapped


def _is_swept() -> bool:
    return HydraConfig.get().mode == RunMode.MULTIRUN


def _note(text: str) -> None:
    """Writes an error into the log of a sweep's job."""
    with suppress(OSError), _log(Path(HydraConfig.get().runtime.output_dir)).open("a") as log:
        log.write(text.rstrip() + "\n")


def _log(job: Path) -> Path:
    """The log of a sweep's job."""
    return job / f"{OmegaConf.load(job / records.MARK / 'hydra.yaml').hydra.job.name}.log"


def _run(name: str, entry: Callable[[], Any]) -> Any:
    os.environ["HYDRA_FULL_ERROR"] = "1"  # errors reach the lines below instead of a print
    words = sys.argv[1:]
    try:
        result = entry()
        if (sweep := runs.sweep_folder()) and not records.jobs(sweep):
            _fail(name, "the sweep is empty: a setting that it sweeps over has no values")
        return result
    except Stopped as stopped:
        saved()
        if sweep := runs.sweep_folder():
            others = [word for word in words if records.setting(word) != "hydra.sweep.dir"]
            again = f"{shlex.join(others)} {typed('hydra.sweep.dir', sweep)}"
            stopped.how_to_go_on = f"forestrl {name} {again}"
        print(f"forestrl {name}: {stopped}", file=sys.stderr)
        sys.exit(stopped.status)
    except runs.Refusal as refusal:
        _fail(name, describe(refusal.__cause__ or refusal))
    except Exception as error:
        failed = _failed_jobs(runs.sweep_folder())
        if _debug() or not (failed or is_users(error)):
            raise
        _fail(name, *(failed or [describe(error)]))
    finally:
        runs.leave()
        del os.environ["HYDRA_FULL_ERROR"]


def _failed_jobs(sweep: Path | None) -> list[str]:
    """Names the jobs of a sweep that failed, with what their logs say last."""
    lines = []
    for job in records.jobs(sweep) if sweep else []:
        log = _log(job)
        if records.finished(job) is None and log.is_file() and log.stat().st_size:
            words = " ".join(records.began_with(job))
            lines.append(f"{log}: job {job.name} ({words}) failed: {_last_line(log)}")
    return lines


def _last_line(log: Path) -> str:
    return log.read_text(errors="replace").rstrip().rpartition("\n")[2]


def asked_for() -> set[str]:
    """Names the settings given on the command line or by the sweep, without their values."""
    return {records.setting(override) for override in HydraConfig.get().overrides.task}


def run_folder(cfg: DictConfig) -> Path:
    """Gives the folder that a command writes into: of an earlier run if it goes on with one."""
    resume, job = cfg.get("resume"), HydraConfig.get()
    if job.mode == RunMode.RUN:
        return Path(job.runtime.output_dir)
    if resume is None:
        return runs.take(Path(job.runtime.output_dir))
    return runs.take_up(Path(resume), job.job.name)


def configuration(
    cfg: DictConfig, folder: Path, why_not: Callable[[str], str | None]
) -> DictConfig:
    """Gives the configuration of a run: its own if it goes on, with what is asked for now.

    Args:
        cfg: what the command line gives.
        folder: of the run.
        why_not: why a setting cannot be changed on the way; None if it can.

    Raises:
        ValueError: if one is asked for that cannot.
    """
    if cfg.resume is None:
        return cfg
    job = HydraConfig.get()
    choices = {str(group): str(option) for group, option in job.runtime.choices.items()}
    return records.resumed(cfg, folder, list(job.overrides.task), choices, why_not)


def keep(cfg: DictConfig, folder: Path) -> None:
    """Notes that a run goes on, and with which settings."""
    records.unmark(folder)
    if "resume" in asked_for():
        records.record(cfg, folder, list(HydraConfig.get().overrides.task))


def _with_absolute_paths(cfg: DictConfig, settings: Any) -> DictConfig:
    """Lets paths mean what they meant where the command was started."""
    kinds, there = kinds_of(cfg, settings), cfg.copy()
    for name in leaves(cfg):
        value = OmegaConf.select(cfg, name)
        if is_path(kinds.get(name)) and value is not None:
            OmegaConf.update(there, name, to_absolute_path(value))
    return there


def _debug() -> bool:
    return _FULL_ERROR or any(argument.lower() == "debug=true" for argument in sys.argv)


def _fail(name: str, *reasons: str) -> None:
    """Says in one line each why the command ends, with status 1."""
    for reason in reasons:
        print(f"forestrl {name}: {reason}", file=sys.stderr)
    sys.exit(1)
