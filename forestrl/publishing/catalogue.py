"""The data files of this room: what the results are of, and what stands beside them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import yaml

_ROOM = Path(__file__).parent


@cache
def data(name: str) -> Any:
    """Reads a YAML file of this room: ``catalogue``, ``elsewhere`` or ``claims``."""
    return yaml.safe_load((_ROOM / f"{name}.yaml").read_text(encoding="utf-8"))


@cache
def text(name: str) -> str:
    """Reads a text of this room, such as ``results.md``."""
    return (_ROOM / name).read_text(encoding="utf-8")


def settings() -> dict[str, dict[str, Any]]:
    """The forests by the name of their folder."""
    return data("catalogue")["settings"]


def policies() -> dict[str, dict[str, Any]]:
    """The policies by the name of their folder, in the order of the tables."""
    return data("catalogue")["policies"]


def label(policy: str) -> str:
    """What a policy is called; one that is not in the catalogue by its folder."""
    return policies()[policy]["label"] if policy in policies() else f"`{policy}`"


def forest(setting: str) -> str:
    """Says what stands in the arenas of a setting."""
    if setting not in settings():
        return f"`{setting}`"
    return "h = {size}, {n_trees} trunks".format_map(settings()[setting])


def ranked(policy: str) -> bool:
    """Whether a policy competes for the best of a column."""
    return policies().get(policy, {}).get("ranked", True)


def ordered(names: Iterable[str]) -> list[str]:
    """Puts policies into the order of the catalogue, unknown ones last."""
    known = list(policies())
    return sorted(names, key=lambda name: (known.index(name) if name in known else 99, name))
