"""What a setting may be: its kind and range stand in a signature, once, and are checked from there.

An annotation says both, for a constructor and for the configuration that calls it::

    @checked
    def __init__(self, size: Annotated[int, Range(3, 1000)], mode: Literal["mean", "concat"]): ...

>>> check({"size": 2}, {"size": Annotated[int, Range(3, 1000)]})
Traceback (most recent call last):
ValueError: size=2 is not allowed: it must be a whole number from 3 to 1000
"""

from __future__ import annotations

import inspect
import math
import numbers
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, wraps
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin

from forestrl.wording import decimal, written

_P = ParamSpec("_P")
_R = TypeVar("_R")
_UNIONS, _LISTS = (Union, UnionType), (list, tuple, Sequence)
_WORDS = {
    bool: ("true or false", "true or false"),
    int: ("a whole number", "whole numbers"),
    float: ("a number", "numbers"),
    str: ("text", "texts"),
    Path: ("a path", "paths"),
    list: ("a list", "lists"),
}


@dataclass(frozen=True)
class Range:
    """Numbers between two ends; of a list, how many entries it may have.

    Args:
        low: the least number.
        high: the greatest number.
        above: what the number must be more than.
        odd: only odd numbers.
    """

    low: float | None = None
    high: float | None = None
    above: float | None = None
    odd: bool = False

    def __contains__(self, value: float) -> bool:
        """Tells whether a number is in the range."""
        return (
            (self.low is None or value >= self.low)
            and (self.high is None or value <= self.high)
            and (self.above is None or value > self.above)
            and (not self.odd or value % 2 == 1)
        )

    def __str__(self) -> str:
        """Says the ends, such as ``from 3 to 1000`` or ``more than 0``."""
        if self.low is not None and self.high is not None:
            return f"from {decimal(self.low)} to {decimal(self.high)}"
        ends = (("of at least", self.low), ("more than", self.above), ("at most", self.high))
        return " and ".join(f"{words} {decimal(end)}" for words, end in ends if end is not None)


def checked(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Checks the arguments of each call against the function's own annotations.

    What an annotation cannot say, such as that one value divides another, is left to the function.

    Raises:
        ValueError: when called with a value of another kind or out of its range.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def call(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError:  # not its arguments: Python's own words say which
            return function(*args, **kwargs)
        check(given, _kinds(function))
        return function(*args, **kwargs)

    return call


@cache
def _kinds(function: Callable[..., Any]) -> dict[str, Any]:
    """The annotations of a function's arguments."""
    names = getattr(function, "__globals__", {})
    return {
        name: evaluated(parameter.annotation, names)
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
    }


def evaluated(annotation: Any, names: Mapping[str, Any]) -> Any:
    """Evaluates an annotation that is a string; Any if there is none, or one that is no kind."""
    if not isinstance(annotation, str):
        return Any if annotation is inspect.Parameter.empty else annotation
    try:
        return eval(annotation, {}, names)
    except Exception:  # names that only a type checker knows
        return Any


def check(values: Mapping[str, Any], kinds: Mapping[str, Any], prefix: str = "") -> None:
    """Refuses values of another kind or out of their range.

    Args:
        values: the settings by name.
        kinds: annotations by name; a name without one may be anything.
        prefix: what stands before the names in the message, such as ``env.``.

    Raises:
        ValueError: naming the setting, its value and what is allowed.
    """
    for name, value in values.items():
        kind = kinds.get(name, Any)
        if not allows(kind, value):
            raise not_allowed(prefix + name, value, f"it must be {describe(kind)}")


def not_allowed(name: str, value: Any, reason: str) -> ValueError:
    """Gives the error for a setting that is not allowed.

    >>> not_allowed("env.size", None, "it must be a whole number")
    ValueError('env.size=null is not allowed: it must be a whole number')
    """
    return ValueError(f"{name}={written(value)} is not allowed: {reason}")


def allows(kind: Any, value: Any) -> bool:
    """Tells whether a value is of a kind and in its range.

    A kind that is no kind of setting, such as a module or Any, allows everything.

    >>> allows(Annotated[float, Range(above=0)], 1), allows(float, math.nan), allows(int, True)
    (True, False, False)
    """
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return allows(parts[0], value) and all(_in(value, limit) for limit in parts[1:])
    if origin in _UNIONS:
        return any(allows(part, value) for part in parts)
    if origin is Literal:
        return any(type(value) is type(part) and value == part for part in parts)
    if origin in _LISTS:
        return _is_list(value) and _entries_allowed(origin, parts, value)
    simple = {
        None: value is None,
        NoneType: value is None,
        bool: isinstance(value, bool),
        int: isinstance(value, numbers.Integral) and not isinstance(value, bool),
        float: _is_number(value),
        str: isinstance(value, str),
        Path: isinstance(value, str | PathLike),
        list: _is_list(value),
    }
    return simple.get(kind, True) if isinstance(kind, type | None) else True


def is_path(kind: Any) -> bool:
    """Tells whether a kind is that of a file or folder."""
    return kind is Path or any(is_path(part) for part in get_args(kind))


def _is_number(value: Any) -> bool:
    real = isinstance(value, numbers.Real) and not isinstance(value, bool)
    return real and math.isfinite(value)


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def _in(value: Any, limit: Any) -> bool:
    if not isinstance(limit, Range) or value is None:
        return True
    return (len(value) if _is_list(value) else value) in limit


def _entries_allowed(origin: Any, kinds: Sequence[Any], values: Sequence[Any]) -> bool:
    if origin is tuple and kinds[-1] is not Ellipsis:
        return len(kinds) == len(values) and all(map(allows, kinds, values))
    return all(allows(kinds[0], value) for value in values)


def describe(kind: Any, plural: bool = False) -> str:
    """Says a kind and its range in words; nothing of what is no kind of setting.

    >>> describe(Annotated[list[Annotated[int, Range(1, odd=True)]], Range(2)] | None)
    'a list of at least 2 odd whole numbers of at least 1, or null'
    """
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        limit = next((part for part in parts[1:] if isinstance(part, Range)), Range())
        return _limited(parts[0], limit, plural)
    if origin in _UNIONS:
        words = [describe(part, plural) for part in parts if part is not NoneType]
        return " or ".join(words) + (", or null" if NoneType in parts else "")
    if origin is Literal:
        *others, last = (written(part) for part in parts)
        return f"{', '.join(others)} or {last}" if others else last
    if origin is tuple and parts[-1] is not Ellipsis:
        return f"a list of {len(parts)} {describe(parts[0], True)}"
    if origin in _LISTS:
        return f"a list of {describe(parts[0], True)}"
    one, many = _WORDS.get(kind, ("", ""))
    return many if plural else one


def _limited(kind: Any, limit: Range, plural: bool) -> str:
    """Says a kind with its range: before the entries of a list, behind a number."""
    if get_origin(kind) in _LISTS:
        least = "one or more" if limit.low == 1 else f"at least {decimal(limit.low or 0)}"
        return f"a list of {least} {describe(get_args(kind)[0], True)}"
    words = describe(kind, plural)
    if limit.odd:
        words = f"odd {words}" if plural else f"an odd {words.removeprefix('a ')}"
    return f"{words} {limit}".rstrip()
