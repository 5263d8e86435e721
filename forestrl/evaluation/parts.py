"""What an evaluation has finished, kept on disk, so that an interrupted one goes on."""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

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
        path = folder / _SETTINGS
        if path.exists():
            found = json.loads(path.read_text())
            for name in sorted({*wanted, *found}):
                if wanted.get(name) != found.get(name):
                    raise ValueError(
                        f"{folder} holds parts of an evaluation with {name}={found.get(name)}, not "
                        f"{wanted.get(name)}: go on with the same settings or in another folder"
                    )
        else:
            atomic_write(path, json.dumps(wanted, indent=2) + "\n")

    def load(self, indices: Sequence[int]) -> Episodes | None:
        """Gives the episodes of a chunk, or None if they are not there or not whole."""
        try:
            with np.load(self._path(indices), allow_pickle=False) as arrays:
                episodes = Episodes(**{name.name: arrays[name.name] for name in fields(Episodes)})
        except (OSError, KeyError, ValueError, zipfile.BadZipFile):
            return None
        return episodes if episodes.index.tolist() == list(indices) else None

    def save(self, episodes: Episodes) -> None:
        """Keeps the episodes of a chunk."""
        data = io.BytesIO()
        np.savez(data, **{name.name: getattr(episodes, name.name) for name in fields(Episodes)})
        atomic_write(self._path(episodes.index.tolist()), data.getvalue())

    def clear(self) -> None:
        """Removes the folder, when the whole is written."""
        shutil.rmtree(self.folder)

    def _path(self, indices: Sequence[int]) -> Path:
        return self.folder / f"{indices[0]}-{indices[-1]}.npz"
