"""The words of the command line: as people type them, as Hydra wants them, and to be pasted."""

from __future__ import annotations

import re
import shlex
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from forestrl import runs
from forestrl.config import text_settings
from forestrl.help import help_text
from forestrl.records import setting

_WITH_A_WORD = (
    *("--config-dir", "-cd", "--config-path", "-cp", "--config-name", "-cn"),
    *("--cfg", "-c", "--package", "-p", "--experimental-rerun"),
)
_LATEST = "checkpoint=latest"
_NUMBER = re.compile(r"[-+]?(\d[\d_]*\.?[\d_]*|\.\d+)(e[-+]?\d+)?|[-+]?(inf|nan)|true|false", re.I)
_PLAIN = re.compile(r"[\w./:@%+-]+", re.ASCII)  # the same to the shell and to Hydra


def prepare_words(name: str, settings: Any) -> None:
    """Puts the words of the command line into the form that Hydra wants."""
    options, overrides = _sorted(sys.argv[1:])
    texts = (*text_settings(settings), "hydra.run.dir", "hydra.sweep.dir")
    overrides = [_as_text(each) if setting(each) in texts else each for each in overrides]
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
