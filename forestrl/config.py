"""The configuration: where its files lie, and whether what was composed from them is allowed.

``conf/`` stands beside a checkout and inside a wheel. A node with a ``_target_`` may hold what that
class takes, by its signature; all else is declared by the command, as a dataclass whose fields are
annotated in the same way.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_type_hints

from omegaconf import DictConfig, OmegaConf

from forestrl.settings import allows, check, not_allowed
from forestrl.signatures import signature
from forestrl.wording import nearest

_PACKAGE = Path(__file__).resolve().parent
CONF_DIR = str(next(p for p in (_PACKAGE / "conf", _PACKAGE.parent / "conf") if p.is_dir()))

_LABEL = "name"  # of the option that was chosen for a group


class Node:
    """A group of settings whose ``_target_`` names a class or function that takes them."""


class OptionalNode:
    """A group whose ``_target_`` may also be null, for nothing."""


_NODES = {Node: "", OptionalNode: "left.out"}  # and what stands for null


def check_all(cfg: DictConfig, declared: Any = None, asked: Collection[str] = ()) -> None:
    """Refuses a configuration with a setting that is missing, unknown or not allowed.

    Args:
        cfg: the whole configuration.
        declared: the command's own settings, a dataclass. Its ``unread`` names what of the shared
            ones the command does not read; its ``check`` says what no single setting can.
        asked: names of the settings that were given for this run; those that nothing reads are
            refused.

    Raises:
        ValueError: naming the setting, its value and what is allowed.
    """
    kinds = kinds_of(cfg, declared)
    _check_known(cfg, kinds, asked)
    if declared is not None:
        _check_present(cfg, declared)
        _check_asked(cfg, kinds, declared, asked)
    for said, name in _sources(cfg, kinds):
        check({said: OmegaConf.select(cfg, name)}, {said: kinds[name]})
    if hasattr(declared, "check"):
        declared.check(cfg)


def kinds_of(cfg: DictConfig, declared: Any = None) -> dict[str, Any]:
    """The kind of each setting that is declared, or taken by a node, by its dotted name.

    A setting that only another one follows, as ``env.size`` for ``env.world.shape``, has its kind.
    """
    kinds = _kinds_of(cfg, _declared(declared), "")
    for name, raw in leaves(cfg).items():
        if other := followed(raw):
            kinds.setdefault(other, kinds.get(name, Any))
    return kinds


def _sources(cfg: DictConfig, kinds: dict[str, Any]) -> list[tuple[str, str]]:
    """Where the value of each setting is written, and the setting; its own kind comes first."""
    values = leaves(cfg)
    groups = [name for name in kinds if isinstance(OmegaConf.select(cfg, name), DictConfig)]
    pairs = [(followed(values.get(name)) or name, name) for name in (*values, *groups)]
    return sorted(
        ((said, name) for said, name in pairs if name in kinds),
        key=lambda pair: pair[0] != pair[1],
    )


def followed(raw: Any) -> str | None:
    """The setting that another one is equal to; None for one with a value of its own."""
    match = re.fullmatch(r"\$\{([\w.]+)\}", str(raw))
    return match and match[1]


def _kinds_of(node: DictConfig, kinds: dict[str, Any], prefix: str) -> dict[str, Any]:
    found = {f"{prefix}{key}": kind for key, kind in kinds.items() if not is_dataclass(kind)}
    for key, value in _items(node):
        if isinstance(value, DictConfig):
            target = _target(value)
            taken = target and signature(target)
            inner = taken.kinds if taken else _declared(kinds.get(key) if not target else None)
            found |= _kinds_of(value, inner, f"{prefix}{key}.")
    return found


def _declared(section: Any) -> dict[str, Any]:
    if not is_dataclass(section):
        return {}
    kinds = get_type_hints(section, include_extras=True)
    return {field.name: kinds[field.name] for field in fields(section)}


def _items(node: DictConfig) -> list[tuple[str, Any]]:
    """The settings of a node without Hydra's own, interpolations as they are."""
    pairs = node.items_ex(resolve=False)
    return [(str(key), value) for key, value in pairs if key != "hydra"]


def _target(node: DictConfig) -> str | None:
    return None if node.get("_target_") is None else str(node["_target_"])


def leaves(node: DictConfig, prefix: str = "") -> dict[str, Any]:
    """All settings by their dotted names, interpolations as they are; a list is one setting."""
    found: dict[str, Any] = {}
    for key, value in _items(node):
        name = f"{prefix}{key}"
        inner = isinstance(value, DictConfig) and len(value)
        found |= leaves(value, f"{name}.") if inner else {name: value}
    return found


def text_settings(declared: Any, prefix: str = "") -> list[str]:
    """The declared settings that are texts or paths: a number given for one is a name."""
    names: list[str] = []
    for key, kind in _declared(declared).items():
        if is_dataclass(kind):
            names += text_settings(kind, f"{prefix}{key}.")
        elif kind not in _NODES and allows(kind, "text") and not allows(kind, 0):
            names.append(f"{prefix}{key}")
    return names


def _check_known(
    node: DictConfig, kinds: dict[str, Any], asked: Collection[str], prefix: str = ""
) -> None:
    """Refuses settings that the class of their node does not take."""
    target = _target(node)
    taken = signature(target) if target else None
    for key, value in _items(node):
        name = f"{prefix}{key}"
        if taken and not taken.open and name not in kinds and key != _LABEL and key[0] != "_":
            for other in asked:  # as env.world.shape, which follows env.size
                if re.fullmatch(rf"{re.escape(prefix)}\w+\.\w+", other):
                    raise ValueError(f"{other} is not to be set: {name} is its other name")
            hint = nearest(name, [other for other in kinds if other.startswith(prefix)])
            raise ValueError(f"{name} is not a setting of {target}{hint}")
        if isinstance(value, DictConfig):
            _check_known(value, kinds, asked, f"{name}.")


def is_unread(declared: Any, name: str) -> bool:
    """Tells whether a command has a setting, or the group it is in, but does not read it."""
    return any(f"{name}.".startswith(f"{each}.") for each in getattr(declared, "unread", ()))


def _check_asked(
    cfg: DictConfig, kinds: dict[str, Any], declared: Any, asked: Collection[str]
) -> None:
    """Refuses what was asked for and changes nothing."""
    for name in asked:
        if is_unread(declared, name):
            known = [other for other in kinds if not is_unread(declared, other)]
            raise ValueError(f"{name} is not read by this command{nearest(name, known)}")
    values = leaves(cfg)
    of_others = {followed(raw) for raw in values.values()}
    for name in sorted({*asked} - kinds.keys() - of_others):
        group, _, key = name.rpartition(".")
        if group and key == _LABEL:
            raise ValueError(f"{name} is a label: choose with {group}={values.get(name, 'NAME')}")
        if name not in values:  # a group
            continue
        if not group or (_target(OmegaConf.select(cfg, group)) is None and key[0] != "_"):
            raise ValueError(f"there is no setting {name}{nearest(name, kinds)}")


def _check_present(node: DictConfig, declared: Any, prefix: str = "") -> None:
    """Refuses a configuration without a setting that the command needs."""
    for key, kind in _declared(declared).items():
        name, value = f"{prefix}{key}", node.get(key)
        if key not in node:
            raise ValueError(f"there is no {name}, which is needed")
        if not is_dataclass(kind) and kind not in _NODES:
            continue
        if not isinstance(value, DictConfig):
            raise not_allowed(name, value, "it is a group with settings of its own")
        if is_dataclass(kind):
            _check_present(value, kind, f"{name}.")
        elif not re.fullmatch(r"(\w+\.)+\w+", _target(value) or _NODES[kind]):
            reason = "it must be a class or function, such as mine.Thing"
            raise not_allowed(f"{name}._target_", value.get("_target_"), reason)
