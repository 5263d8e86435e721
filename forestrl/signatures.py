"""The settings of a class or function, read from its source: nothing that it needs is imported.

Help and checks come before the work, and importing torch takes longer than either.
"""

from __future__ import annotations

import ast
import builtins
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import Any, NamedTuple

from forestrl.settings import evaluated

_READ_ONLY = ("forestrl.settings", "pathlib", "typing", "collections.abc")
"""Modules that annotations are made of; all others are read, not imported."""


class Signature(NamedTuple):
    """The arguments of a class or function.

    Attributes:
        kinds: their annotations by name, Any where there is none.
        open: whether it takes others too.
    """

    kinds: dict[str, Any]
    open: bool


@cache
def signature(target: str) -> Signature | None:
    """Reads the arguments of a ``_target_``, such as ``forestrl.envs.ForestEnv``.

    Returns:
        None if there is no such class or function, or its source cannot be read.
    """
    module, _, name = target.rpartition(".")
    found = _find(module, name)
    if found is None:
        return None
    source, node = found
    if isinstance(node, ast.ClassDef):
        source, node = _constructor(source, node) or found
    if not isinstance(node, ast.FunctionDef):
        return Signature({}, open=True)
    arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    kinds = {each.arg: source.evaluate(each.annotation) for each in arguments if each.arg != "self"}
    return Signature(kinds, open=node.args.kwarg is not None)


class _Source(Mapping[str, Any]):
    """A module's source; as a mapping, the values of the names that annotations are made of."""

    def __init__(self, path: Path, name: str, package: bool) -> None:
        self.name, self.package = name, package
        tree = ast.parse(path.read_bytes())
        self.bound = {name: node for node in _statements(tree.body) for name in _names(node)}

    def evaluate(self, annotation: ast.expr | None) -> Any:
        return Any if annotation is None else evaluated(ast.unparse(annotation), self)

    def __getitem__(self, name: str) -> Any:
        node = self.bound.get(name)
        if node is None:
            return getattr(builtins, name)
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            return eval(ast.unparse(node.value), {}, self)
        if isinstance(node, ast.ImportFrom):
            module, original = self.origin(node, name)
            if module in _READ_ONLY:
                return getattr(import_module(module), original)
            if (source := _read(module)) is not None:
                return source[original]
        raise KeyError(name)

    def origin(self, node: ast.ImportFrom, name: str) -> tuple[str, str]:
        """The module that a name is imported from, and what it is called there."""
        original = next(alias.name for alias in node.names if name in (alias.asname, alias.name))
        home = self.name.split(".")
        home = home[: len(home) - node.level + self.package] if node.level else []
        return ".".join([*home, *filter(None, [node.module])]), original

    def __iter__(self) -> Iterator[str]:
        return iter(self.bound)

    def __len__(self) -> int:
        return len(self.bound)


@cache
def _read(module: str) -> _Source | None:
    """Reads a module; None if there is none with a source."""
    spec = _spec(module)
    if spec is None or not spec.origin or not spec.origin.endswith(".py"):
        return None
    return _Source(Path(spec.origin), module, spec.submodule_search_locations is not None)


def _spec(module: str) -> ModuleSpec | None:
    """Finds a module without importing the packages it is in, as ``find_spec`` would."""
    spec, parts = None, module.split(".")
    for end in range(1, len(parts) + 1):
        path = sys.path if end == 1 else spec and spec.submodule_search_locations
        spec = path and PathFinder.find_spec(".".join(parts[:end]), path)
        if not spec:
            return None
    return spec or None


def _find(module: str, name: str) -> tuple[_Source, ast.stmt] | None:
    """Finds where a name is defined, following imports."""
    source = _read(module) if module else None
    if source is None or (node := source.bound.get(name)) is None:
        return None
    if isinstance(node, ast.ImportFrom):
        return _find(*source.origin(node, name))
    return source, node


def _constructor(source: _Source, node: ast.ClassDef) -> tuple[_Source, ast.stmt] | None:
    """Finds ``__init__`` of a class, its own or that of the first base class with one."""
    for statement in node.body:
        if isinstance(statement, ast.FunctionDef) and statement.name == "__init__":
            return source, statement
    for base in node.bases:
        home, found = _find(source.name, ast.unparse(base)) or (source, None)
        if isinstance(found, ast.ClassDef) and (inherited := _constructor(home, found)):
            return inherited
    return None


def _statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """A module's statements, also those under an ``if`` or ``try``."""
    for node in body:
        yield node
        yield from _statements(
            getattr(node, "body", []) if isinstance(node, ast.If | ast.Try) else []
        )


def _names(node: ast.stmt) -> list[str]:
    """The names that a statement binds."""
    if isinstance(node, ast.ClassDef | ast.FunctionDef):
        return [node.name]
    if isinstance(node, ast.ImportFrom):
        return [alias.asname or alias.name for alias in node.names]
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return [target.id for target in targets if isinstance(target, ast.Name)]
