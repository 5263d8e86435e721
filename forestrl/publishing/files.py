"""The files behind the figures, read with errors that name the file and the line."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_SUMMARY = (
    *("arenas", "steps", "coverage", "area_under_curve", "collisions", "meta", "steps_to.98"),
    *("interventions.rate", "interventions.percentile_80", "interventions.share_under_15"),
)


class ResultError(ValueError):
    """A result that is missing, unreadable or not what its place says."""


def read_summary(path: Path) -> dict[str, Any]:
    """Reads a summary.json.

    Raises:
        ResultError: if it is missing, no JSON, or lacks an entry.
    """
    try:
        summary = json.loads(_text(path))
    except ValueError as error:
        raise (
            error
            if isinstance(error, ResultError)
            else ResultError(f"{path} is not valid JSON: {error}")
        ) from error
    if missing := [name for name in _SUMMARY if not _has(summary, name.split("."))]:
        raise ResultError(f"{path} lacks {', '.join(missing)}")
    return summary


_WORDS = ("ending",)


def read_columns(path: Path, needed: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
    """Reads the numbers of a CSV file; empty fields become nan, columns of words are left out.

    Raises:
        ResultError: if it is missing or empty, lacks a column, or holds something else.
    """
    reader = csv.reader(_text(path).splitlines())
    head = next(reader, [])
    if missing := [name for name in needed if name not in head]:
        raise ResultError(f"{path} lacks the column {', '.join(missing)}")
    columns = [column for column, name in enumerate(head) if name not in _WORDS]
    rows = []
    for number, row in enumerate(reader, start=2):
        if len(row) != len(head):
            raise ResultError(f"{path}, line {number}: {len(row)} fields instead of {len(head)}")
        try:
            rows.append([float(row[column] or "nan") for column in columns])
        except ValueError as error:
            raise ResultError(f"{path}, line {number}: {error}") from error
    if not rows:
        raise ResultError(f"{path} has no rows")
    return dict(zip([head[column] for column in columns], np.array(rows).T, strict=True))


def _has(tree: Any, names: list[str]) -> bool:
    """Tells whether an entry is there, named from the root."""
    for name in names:
        if not isinstance(tree, dict) or name not in tree:
            return False
        tree = tree[name]
    return True


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise ResultError(f"{path} is missing") from error
    except UnicodeDecodeError as error:
        raise ResultError(f"{path} is not a text file") from error
