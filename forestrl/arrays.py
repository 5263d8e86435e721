"""Arrays as files that are whole or count as not there."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from forestrl.storage import atomic_write


def save_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Writes arrays, compressed, with the checksums that zip files have."""
    data = io.BytesIO()
    np.savez_compressed(data, **arrays)
    atomic_write(path, data.getvalue())


def load_arrays(path: Path, names: Iterable[str]) -> dict[str, np.ndarray] | None:
    """Reads arrays by name; None if the file is missing, empty, torn, damaged or another's."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in names}
    except Exception:  # a damaged file makes the reader fail in every possible way
        return None
