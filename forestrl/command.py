"""What all commands share: Hydra's entry, settings checked before the work, errors in one line."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Callable
from functools import wraps
from itertools import pairwise
from pathlib import Path
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException, InstantiationException
from hydra.types import RunMode
from hydra.utils import to_absolute_path
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from forestrl import runs
from forestrl.config import CONF_DIR, check_all, followed, kinds_of, leaves, text_settings
from forestrl.help import help_text
from forestrl.settings import is_path
from forestrl.terminal import lasting_output
from forestrl.wording import nearest

_USER_ERRORS = (ValueError, OSError, HydraException, OmegaConfBaseException)
_WITH_A_WORD = (
    *("--config-dir", "-cd", "--config-path", "-cp", "--config-name", "-cn"),
    *("--cfg", "-c", "--package", "-p", "--experimental-rerun"),
)
_LATEST = "checkpoint=latest"
_NUMBER = re.compile(r"[-+]?(\d[\d_]*\.?[\d_]*|\.\d+)(e[-+]?\d+)?|[-+]?(inf|nan)|true|false", re.I)
_PLAIN = re.compile(r"[\w./:@%+-]+", re.ASCII)  # the same to the shell and to Hydra
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
                return function(cfg)
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
            _prepare_words(name, settings)
            return entry()

        @wraps(function)
        def main() -> Any:
            with lasting_output():
                return _run(name, started)

        return main

    return decorate


def _in_one_line(name: str, job: Job) -> Job:
    """Ends the program where a job fails; in a sweep the others go on."""

    @wraps(job)
    def wrapped(cfg: DictConfig) -> Any:
        try:
            return job(cfg)
        except _USER_ERRORS as error:
            if _debug():
                raise
            text = _with_whole_names(describe(error), cfg)
            if HydraConfig.get().mode == RunMode.MULTIRUN:
                raise ValueError(text) from error
            _fail(name, text)  # Hydra would say more about it

    return wrapped


def _run(name: str, entry: Callable[[], Any]) -> Any:
    os.environ["HYDRA_FULL_ERROR"] = "1"  # errors reach the lines below instead of a print
    try:
        return entry()
    except runs.Refusal as refusal:
        _fail(name, describe(refusal.__cause__ or refusal))
    except _USER_ERRORS as error:
        if _debug():
            raise
        _fail(name, describe(error))
    finally:
        runs.leave()
        del os.environ["HYDRA_FULL_ERROR"]


def asked_for() -> set[str]:
    """Names the settings given on the command line or by the sweep, without their values."""
    return {_setting(override) for override in HydraConfig.get().overrides.task}


def _setting(override: str) -> str:
    return override.lstrip("+~").partition("=")[0]


def run_folder(cfg: DictConfig) -> Path:
    """Gives the folder that a command writes into: of an earlier run if it goes on with one."""
    resume, job = cfg.get("resume"), HydraConfig.get()
    if resume is None or job.mode == RunMode.RUN:
        return Path(job.runtime.output_dir)
    return runs.take_up(Path(resume), job.job.name)


def _prepare_words(name: str, settings: Any) -> None:
    """Puts the words of the command line into the form that Hydra wants."""
    options, overrides = _sorted(sys.argv[1:])
    texts = (*text_settings(settings), "hydra.run.dir", "hydra.sweep.dir")
    overrides = [_as_text(each) if _setting(each) in texts else each for each in overrides]
    if _LATEST in overrides and "checkpoint" in texts and not Path("latest").exists():
        latest = runs.latest_training()
        print(f"{_LATEST}: {latest}", file=sys.stderr)
        overrides[overrides.index(_LATEST)] = f"checkpoint={runs.quoted(str(latest))}"
    if {"-h", "--help"} & set(options):

        def template(*, _root_: DictConfig) -> str:
            return help_text(name, _root_, settings).replace("$", "$$")

        OmegaConf.register_new_resolver("help", template, replace=True)
        overrides.append("hydra.help.template=${help:}")
    sys.argv[1:] = [*options, *overrides]


def _sorted(words: list[str]) -> tuple[list[str], list[str]]:
    """Parts Hydra's options from the settings, which it wants side by side."""
    options: list[str] = []
    overrides: list[str] = []
    for before, word in pairwise(["", *words]):
        option = word.startswith("-") or before in _WITH_A_WORD
        (options if option else overrides).append(word)
    return options, overrides


def _as_text(word: str) -> str:
    """Quotes what Hydra would not take as it is: a folder may be called ``1e3`` or ``beta=0.5``."""
    key, _, value = word.partition("=")
    if re.search(r"['\"()\[\]{}$]", value):  # written in Hydra's own grammar
        return word
    plain = [bool(_PLAIN.fullmatch(p)) and not _NUMBER.fullmatch(p) for p in value.split(",")]
    parts = zip(value.split(","), plain, strict=True)
    return f"{key}={','.join(part if fits else runs.quoted(part) for part, fits in parts)}"


def typed(name: str, value: object) -> str:
    """Writes a setting so that it can be pasted into a shell.

    >>> print(typed("checkpoint", "outputs/a b=c"))
    'checkpoint="outputs/a b=c"'
    """
    text = str(value)
    plain = _PLAIN.fullmatch(text) and text != "null"
    return shlex.quote(f"{name}={text if plain else runs.quoted(text)}")


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


def _fail(name: str, text: str) -> None:
    """Says in one line why the command ends, with status 1."""
    print(f"forestrl {name}: {text}", file=sys.stderr)
    sys.exit(1)


def describe(error: BaseException) -> str:
    """Puts an error into one line, from its first cause."""
    made = ""
    while isinstance(error, InstantiationException) and error.__cause__ is not None:
        target = re.search(r"target '([\w.]+)'", str(error))
        node = re.search(r"full_key: ([\w.]+)", str(error))
        made = (f"{node[1]}: " if node else "") + target[1] if target else made
        error = error.__cause__
    text = " ".join(str(error).split()).partition(" Config search path:")[0]
    if unknown := re.search(r"Could not override '([^']+)'", text):
        return f"there is no setting {unknown[1]}{_meant(unknown[1], error.__cause__)}"
    if text.startswith("Error merging override") and error.__cause__ is not None:
        return f"{text}: {str(error.__cause__).splitlines()[0]}"
    if made and not isinstance(error, _USER_ERRORS):
        return f"{made} cannot be made: {type(error).__name__}: {text}; debug=true shows where"
    return text


def _with_whole_names(text: str, cfg: DictConfig) -> str:
    """Writes ``env.size=2`` for the ``shape=2`` of a class that knows no other name for it."""
    names: dict[str, set[str]] = {}
    for name, raw in leaves(cfg).items():
        names.setdefault(name.rpartition(".")[2], set()).add(followed(raw) or name)
    whole = {last: next(iter(found)) for last, found in names.items() if len(found) == 1}
    return re.sub(r"(?<![\w./])(\w+)(?==)", lambda match: whole.get(match[1], match[1]), text)


def _meant(name: str, cause: BaseException | None) -> str:
    """Says which setting of the same configuration was probably meant."""
    node = getattr(cause, "parent_node", None)
    if node is None:
        return ""
    return nearest(name, leaves(node._get_root()))
