"""How a fault in a file is said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from forestrl.wording import written


def wrong_field(path: Path | str, field: str, value: Any, reason: str) -> ValueError:
    """Gives the error for something in a file that is not allowed.

    Args:
        path: the file.
        field: what in it, such as a YAML file's key, or a line and a column.
        value: what it is there.
        reason: what is allowed.

    >>> wrong_field("map.yaml", "resolution", 0, "it must be a number more than 0")
    ValueError('map.yaml: resolution: 0 is not allowed: it must be a number more than 0')
    """
    return ValueError(f"{path}: {field}: {written(value)} is not allowed: {reason}")
