"""Files that are either whole or not there."""

from __future__ import annotations

import os
import secrets
from pathlib import Path


def atomic_write(path: str | os.PathLike[str], data: str | bytes) -> Path:
    """Writes a file in one go: readers see the old content or the new, never a part.

    The data goes to a hidden file beside the target, on the disk, and then takes its place. If that
    fails, the old file stays and the hidden one is removed.

    Args:
        path: the file, in a folder that exists.
        data: text, written as UTF-8 with its line ends as they are, or bytes.

    Returns:
        the path.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        with part.open("xb") as file:
            file.write(data.encode() if isinstance(data, str) else data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    return path
