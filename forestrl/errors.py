"""Errors in one line, in the words of the configuration."""

from __future__ import annotations

import re

from hydra.errors import HydraException, InstantiationException
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from forestrl.config import followed, leaves
from forestrl.wording import nearest

_USER_ERRORS = (ValueError, OSError, HydraException, OmegaConfBaseException)
_EXTRAS = {
    "cma": "search",
    "pandas": "report",
    "tabulate": "report",
    "wandb_workspaces": "dashboard",
}
"""Libraries that only an extra of the package installs, and that extra."""


def is_users(error: BaseException) -> bool:
    """Tells whether it is an error that a user can mend: it is said without a traceback."""
    return isinstance(error, _USER_ERRORS) or _missing_extra(error) is not None


def _missing_extra(error: BaseException) -> str | None:
    missing = isinstance(error, ModuleNotFoundError) and (error.name or "").partition(".")[0]
    return _EXTRAS.get(missing) if missing else None


def describe(error: BaseException) -> str:
    """Puts an error into one line, from its first cause."""
    made = ""
    while isinstance(error, InstantiationException) and error.__cause__ is not None:
        target = re.search(r"target '([\w.]+)'", str(error))
        node = re.search(r"full_key: ([\w.]+)", str(error))
        made = (f"{node[1]}: " if node else "") + target[1] if target else made
        error = error.__cause__
    if extra := _missing_extra(error):
        return f'this needs pip install "forestrl[{extra}]"'
    text = " ".join(str(error).split()).partition(" Config search path:")[0]
    if unknown := re.search(r"Could not override '([^']+)'", text):
        return f"there is no setting {unknown[1]}{_meant(unknown[1], error.__cause__)}"
    if text.startswith("Error merging override") and error.__cause__ is not None:
        return f"{text}: {str(error.__cause__).splitlines()[0]}"
    if made and not isinstance(error, _USER_ERRORS):
        return f"{made} cannot be made: {type(error).__name__}: {text}; debug=true shows where"
    return text


def with_whole_names(text: str, cfg: DictConfig) -> str:
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
