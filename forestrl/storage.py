"""Files that are either whole or not there."""

from __future__ import annotations

import csv
import io
import math
import numbers
import os
import re
import secrets
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

_PART = ".part"


@contextmanager
def atomic_file(
    path: str | os.PathLike[str], before: str | os.PathLike[str] | None = None
) -> Iterator[BinaryIO]:
    """Opens a file to be written piece by piece: it appears when the block ends.

    The data goes to a hidden file beside the target, on the disk, and then takes its place. If that
    fails, or the block raises, the old file stays and the hidden one is removed.

    Args:
        path: the file, in a folder that exists.
        before: where the old file goes, in a folder that exists; None to replace it.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}{_PART}")
    try:
        with part.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        if before is not None and path.exists():
            os.replace(path, before)
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def atomic_write(
    path: str | os.PathLike[str],
    data: str | bytes,
    before: str | os.PathLike[str] | None = None,
) -> Path:
    """Writes a file in one go: readers see the old content or the new, never a part.

    Args:
        path: the file, in a folder that exists.
        data: text, written as UTF-8 with its line ends as they are, or bytes.
        before: where the old file goes, in a folder that exists; None to replace it.

    Returns:
        the path.
    """
    with atomic_file(path, before) as file:
        file.write(data.encode() if isinstance(data, str) else data)
    return Path(path)


def clear_parts(folder: Path) -> None:
    """Removes what writers that were killed left behind, in a folder that nobody writes into."""
    for path in filter(is_part, folder.rglob(f".*{_PART}")):
        path.unlink(missing_ok=True)


def is_part(path: Path) -> bool:
    """Tells whether a file is one that is being written, or was when its writer was killed."""
    return re.fullmatch(rf"\..+\.[0-9a-f]{{8}}\{_PART}", path.name) is not None


def csv_text(rows: Iterable[Sequence[Any]]) -> str:
    """Lays rows out as CSV, head first: floats with six digits, nan and None as nothing."""
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerows([_entry(value) for value in row] for row in rows)
    return buffer.getvalue()


def _entry(value: object) -> object:
    if isinstance(value, numbers.Real) and not isinstance(value, numbers.Integral | bool):
        return "" if math.isnan(value) else f"{float(value):.6g}"
    return "" if value is None else value
