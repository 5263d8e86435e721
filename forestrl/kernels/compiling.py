"""How functions are compiled: once for all processes, and anew where anything they call changes."""

from __future__ import annotations

import hashlib
import os
import re
import stat
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import caching

_PACKAGE = Path(__file__).resolve().parents[1]
_IMPORTS = re.compile(rf"^from ({_PACKAGE.name}\.[\w.]+) import", re.MULTILINE)


def compiled(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compiles a function with numba, and keeps the result on disk; a decorator.

    Args:
        function: in the part of Python that numba compiles; None for a decorator with options.
        options: of :func:`numba.njit`.
    """
    compile_it = numba.njit(cache=True, **options)
    return compile_it if function is None else compile_it(function)


@cache
def _source_stamp(path: Path) -> bytes:
    """Gives a checksum of a module of this package and of all that it imports from the package.

    Numba itself looks at the function's own file only: what is compiled into it from another file
    would stay as it was when that file changes.
    """
    stamp, seen, todo = hashlib.sha256(), {path}, [path]
    while todo:
        text = todo.pop().read_text(encoding="utf-8")
        stamp.update(text.encode())
        for name in sorted(_IMPORTS.findall(text)):
            base = _PACKAGE.parent.joinpath(*name.split("."))
            found = base / "__init__.py" if base.is_dir() else base.with_suffix(".py")
            if found.is_file() and found not in seen:
                seen.add(found)
                todo.append(found)
    return stamp.digest()


class _WholeSource:
    """Mixed into numba's ways to its cache: the stamp of our functions is of all they call."""

    _py_file: str

    def get_source_stamp(self) -> Any:
        path = Path(self._py_file).resolve()
        if path.is_relative_to(_PACKAGE):
            return _source_stamp(path)
        return super().get_source_stamp()  # type: ignore[misc]


class UserProvided(_WholeSource, caching.UserProvidedCacheLocator):
    """In the folder that NUMBA_CACHE_DIR names."""


class InTree(_WholeSource, caching.InTreeCacheLocator):
    """Beside the source."""


class UserWide(_WholeSource, caching.UserWideCacheLocator):
    """In the user's cache."""


def choose_cache() -> None:
    """Sets where numba keeps what it has compiled.

    It takes the package's folder or the user's cache; with both read-only, as in a hardened
    container, numba would refuse to compile at all, and gets a private temporary folder.
    """
    if numba.config.DISABLE_JIT:
        return
    if not numba.config.CACHE_LOCATOR_CLASSES:
        ours = [f"{__name__}.{c.__name__}" for c in (UserProvided, InTree, UserWide)]
        numba.config.CACHE_LOCATOR_CLASSES = ",".join([*ours, "IPythonCacheLocator"])
    try:
        caching.FunctionCache(choose_cache)
    except RuntimeError:
        numba.config.CACHE_DIR = str(_private_folder())


def _private_folder() -> Path:
    """A folder that nobody else can write to: compiled code is read back from it."""
    folder = Path(tempfile.gettempdir()) / f"forestrl-numba-{os.geteuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.stat(follow_symlinks=False)
        ours = found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IRWXG | stat.S_IRWXO)
    except OSError:
        ours = False
    return folder if ours else Path(tempfile.mkdtemp(prefix="forestrl-numba-"))


choose_cache()
