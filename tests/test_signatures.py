"""Signatures read from the source are those that importing gives, and nothing is imported."""

import inspect
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from hydra.utils import get_object
from omegaconf import DictConfig

from forestrl.cli import COMMANDS
from forestrl.config import CONF_DIR
from forestrl.settings import Range
from forestrl.signatures import signature
from tests.commands import compose

ROOT = Path(__file__).resolve().parents[1]


def targets(node):
    """Every class or function that a configuration calls."""
    for value in node.values():
        if isinstance(value, DictConfig):
            yield from targets(value)
    if node.get("_target_"):
        yield node["_target_"]


def all_targets():
    options = [
        (path.parent.name, path.stem)
        for path in Path(CONF_DIR).glob("*/*.yaml")
        if path.parent.name not in ("experiment", "ablation", "env")
    ]
    found = {target for name in COMMANDS for target in targets(compose(name))}
    for group, option in options:
        primary = "eval" if group == "policy" else "train"
        found |= set(targets(compose(primary, f"{group}={option}")))
    return sorted(found)


@pytest.mark.parametrize("target", all_targets())
def test_every_target_has_the_arguments_that_importing_it_gives(target):
    read, called = signature(target), get_object(target)
    called = called.__init__ if inspect.isclass(called) else called
    parameters = inspect.signature(called).parameters.values()
    named = {p.name for p in parameters if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)}
    assert read is not None and read.kinds.keys() == named - {"self"}
    assert read.open == any(p.kind == p.VAR_KEYWORD for p in parameters)


MINE = '''
from __future__ import annotations
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import nowhere_to_be_found
from forestrl.settings import Range, checked
from .names import Mode as How
from nowhere_to_be_found import Unknown

if TYPE_CHECKING:
    from collections.abc import Sequence

Side = Annotated[int, Range(3)]

class Base:
    @checked
    def __init__(self, side: Side, how: How = "", thing: Unknown = 0, *, file: Path | None): ...

class Child(Base):
    """Has no constructor of its own."""

class Grandchild(nowhere_to_be_found.Other, Child): ...

class Open:
    def __init__(self, a, b: int = 1, **rest): ...

class Foreign(nowhere_to_be_found.Other): ...

def make(sides: Sequence[Side]): ...
'''


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A package of a user's own that could not be imported."""
    package = tmp_path / "my_package_of_signatures"
    package.mkdir()
    (package / "__init__.py").write_text(
        "from my_package_of_signatures.parts import Child as Kid\n"
    )
    (package / "parts.py").write_text(MINE)
    (package / "names.py").write_text(
        'from typing import Literal\nMode = Literal["fast", "slow"]\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    return package.name


SIDE = Annotated[int, Range(3)]


def test_kinds_are_read_through_aliases_imports_and_base_classes(mine):
    expected = {"side": SIDE, "how": Literal["fast", "slow"], "thing": Any, "file": Path | None}
    for name in ("parts.Base", "parts.Child", "parts.Grandchild", "Kid"):
        assert signature(f"{mine}.{name}") == (expected, False), name


def test_functions_and_open_or_foreign_constructors_are_read(mine):
    assert str(signature(f"{mine}.parts.make").kinds["sides"]).startswith(
        "collections.abc.Sequence"
    )
    assert signature(f"{mine}.parts.Open") == ({"a": Any, "b": int}, True)
    assert signature(f"{mine}.parts.Foreign") == ({}, True)


@pytest.mark.parametrize(
    "target", ["my.Nope", "forestrl.Nope", "forestrl.envs.Nope", "Nope", "sys.x"]
)
def test_what_is_not_there_has_no_signature(target):
    assert signature(target) is None


def test_nothing_is_imported():
    code = (
        "import sys; from forestrl.signatures import signature\n"
        f"for target in {all_targets()}: assert signature(target)\n"
        "print({'torch', 'numba', 'numpy', 'torchrl', 'hydra'} & sys.modules.keys())"
    )
    run = [sys.executable, "-c", code]
    result = subprocess.run(run, capture_output=True, text=True, cwd=ROOT, check=True)
    assert result.stdout == "set()\n"
