"""Names and values of settings as a reader meets them in messages, help and commands."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Any


def written(value: Any) -> str:
    """Writes a value as one types it on the command line.

    >>> written([1, None, True, "mean"])
    '[1,null,true,mean]'
    """
    if value is None or isinstance(value, bool):
        return "null" if value is None else str(value).lower()
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return f"[{','.join(map(written, value))}]"
    return str(value)


def decimal(value: float) -> str:
    """Writes the end of a range; powers of two as such, as nobody counts their digits.

    >>> decimal(0.5), decimal(10_000), decimal(2**63 - 1)
    ('0.5', '10_000', '2^63 - 1')
    """
    if value >= 2**16 and int(value + 1).bit_count() == 1:
        return f"2^{int(value + 1).bit_length() - 1} - 1"
    return f"{value:_}" if value >= 10_000 else str(value)


def nearest(name: str, names: Iterable[str]) -> str:
    """Says which of the names were probably meant, or nothing.

    >>> nearest("env.sizze", ["env.size", "env.num_envs", "eval.arenas"])
    ': did you mean env.size?'
    """
    names, last = list(names), name.rpartition(".")[2]
    lasts = get_close_matches(last, [other.rpartition(".")[2] for other in names], cutoff=0.8)
    elsewhere = [other for other in names if other.rpartition(".")[2] in lasts]
    found = dict.fromkeys([*get_close_matches(name, names, cutoff=0.8), *elsewhere])
    return f": did you mean {' or '.join(list(found)[:3])}?" if found else ""
