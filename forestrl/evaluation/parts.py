"""What an evaluation has finished, kept on disk, so that an interrupted one goes on."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from forestrl.arrays import load_arrays, save_arrays
from forestrl.evaluation.episodes import Episodes
from forestrl.storage import atomic_write

_SETTINGS = "settings.json"


class Parts:
    """A folder with the finished chunks of one evaluation.

    Args:
        folder: made if it is missing.
        settings: what the results depend on, as JSON can hold it.

    Raises:
        ValueError: if the folder holds parts of an evaluation with other settings.
    """

    def __init__(self, folder: Path, settings: Mapping[str, Any]) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        wanted = json.loads(json.dumps(settings))
        found = _read(folder / _SETTINGS)
        for name in sorted({*wanted, *found} if found else ()):
            if wanted.get(name) != found.get(name):
                raise ValueError(
                    f"{folder} holds parts of an evaluation with {name}={found.get(name)}, not "
                    f"{wanted.get(name)}: go on with the same settings or in another folder"
                )
        if not found:
            for part in folder.iterdir():  # nobody knows of which evaluation
                part.unlink()
            atomic_write(folder / _SETTINGS, json.dumps(wanted, indent=2) + "\n")

    def load(self, indices: Sequence[int]) -> Episodes | None:
        """Gives the episodes of a chunk, or None if they are not there or not whole."""
        arrays = load_arrays(self._path(indices), [field.name for field in fields(Episodes)])
        if arrays is None:
            return None
        episodes = Episodes(**arrays)
        return episodes if episodes.index.tolist() == list(indices) else None

    def save(self, episodes: Episodes) -> None:
        """Keeps the episodes of a chunk."""
        arrays = {field.name: getattr(episodes, field.name) for field in fields(Episodes)}
        save_arrays(self._path(episodes.index.tolist()), arrays)

    def clear(self) -> None:
        """Removes the folder, when the whole is written."""
        shutil.rmtree(self.folder)

    def _path(self, indices: Sequence[int]) -> Path:
        return self.folder / f"{indices[0]}-{indices[-1]}.npz"


def _read(path: Path) -> dict[str, Any]:
    """The settings of the parts that are there; empty if that cannot be told."""
    try:
        return dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError):
        return {}
