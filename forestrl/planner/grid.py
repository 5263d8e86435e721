"""Occupancy grids as robots publish them, and what is no such grid."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

MOST_CELLS = 1 << 24


class BadInputError(ValueError):
    """A grid, pose or scan that is none; the message names field, value and what is allowed."""


@dataclass(frozen=True)
class Grid:
    """An occupancy grid.

    >>> Grid.of({"width": 2, "height": 1, "resolution": 0.1, "origin": [0, 0], "data": [0]})
    Traceback (most recent call last):
    forestrl.planner.grid.BadInputError: data has 1 values: width=2 times height=1 is 2
    """

    data: np.ndarray
    """Unknown is -1, else the probability of an obstacle in per cent; int8 ``[height, width]``, the
    first row at the least y."""
    resolution: float
    """Side of a cell, metres."""
    origin: tuple[float, float, float]
    """Pose of the outer corner of the first cell: x, y in metres, yaw in radians."""

    @staticmethod
    def of(given: Any) -> Grid:
        """Reads a grid.

        Args:
            given: a mapping with ``width``, ``height``, ``resolution``, ``origin`` (x, y and maybe
                yaw) and ``data``, row by row from the least y; or a Grid.

        Raises:
            BadInputError: if it is none.
        """
        if isinstance(given, Grid):
            given = {
                "width": given.data.shape[-1] if np.ndim(given.data) == 2 else None,
                "height": len(given.data),
                **vars(given),
            }
        if not isinstance(given, Mapping):
            raise BadInputError(f"the grid is of type {type(given).__name__}: it must be a mapping")
        names = ("width", "height", "resolution", "origin", "data")
        if missing := [name for name in names if name not in given]:
            raise BadInputError(f"the grid has no {missing[0]}")
        width, height = (_side(name, given[name]) for name in ("width", "height"))
        if width * height > MOST_CELLS:
            raise BadInputError(
                f"the grid has width={width} times height={height} cells: at most {MOST_CELLS} "
                "are allowed"
            )
        resolution = finite("resolution", given["resolution"])
        if not 1e-6 <= resolution <= 1e6:
            raise BadInputError(
                f"resolution={resolution} is not allowed: it must be metres, above 0"
            )
        origin = numbers_of("origin", given["origin"], (2, 3))
        pose = (origin[0], origin[1], origin[2] if len(origin) == 3 else 0.0)
        return Grid(_values(given["data"], width, height), resolution, pose)


def _side(name: str, value: Any) -> int:
    whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not whole or value < 0:
        raise BadInputError(
            f"{name}={value!r:.40} is not allowed: it must be a whole number, 0 or more"
        )
    return int(value)


def _values(data: Any, width: int, height: int) -> np.ndarray:
    try:
        values = np.asarray(data)
    except (ValueError, TypeError, OverflowError) as error:
        raise BadInputError(f"data is no list of numbers: {error}") from error
    if values.size != width * height:
        raise BadInputError(
            f"data has {values.size} values: width={width} times height={height} is "
            f"{width * height}"
        )
    if values.ndim > 2 or (values.ndim == 2 and values.shape != (height, width)):
        raise BadInputError(f"data has shape {values.shape}: it must be {(height, width)} or flat")
    if values.size == 0:
        return np.zeros((height, width), np.int8)
    if values.dtype.kind not in "iu":
        raise BadInputError("data holds something else than whole numbers")
    low, high = int(values.min()), int(values.max())
    if low < -1 or high > 100:
        wrong = low if low < -1 else high
        raise BadInputError(f"data holds {wrong}: it must be -1 for unknown, or 0 to 100")
    return values.astype(np.int8).reshape(height, width)


def finite(name: str, value: Any) -> float:
    """Reads a number.

    Raises:
        BadInputError: if it is none, or not finite.
    """
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        with_limits = float(value) if abs(float(value)) < 1e100 else math.inf
        if math.isfinite(with_limits):
            return with_limits
    raise BadInputError(f"{name}={value!r:.40} is not allowed: it must be a finite number")


def numbers_of(name: str, values: Any, lengths: Sequence[int]) -> tuple[float, ...]:
    """Reads a list of numbers of one of some lengths.

    Raises:
        BadInputError: if it is none.
    """
    if isinstance(values, np.ndarray):
        values = values.tolist()
    if isinstance(values, str | bytes) or not isinstance(values, Sequence):
        raise BadInputError(f"{name}={values!r:.40} is not allowed: it must be a list of numbers")
    if len(values) not in lengths:
        allowed = " or ".join(str(length) for length in lengths)
        raise BadInputError(f"{name} has {len(values)} numbers: it must have {allowed}")
    return tuple(finite(f"{name}[{i}]", value) for i, value in enumerate(values))


def points_of(name: str, values: Any) -> np.ndarray:
    """Reads a list of points.

    Returns:
        (x, y), float64 ``[n, 2]``, without those that are not finite: beams without a return.

    Raises:
        BadInputError: if it is none.
    """
    try:
        points = np.asarray(values, dtype=np.float64)
    except (ValueError, TypeError, OverflowError) as error:
        raise BadInputError(f"{name} is no list of points: {error}") from error
    if points.size == 0:
        return np.zeros((0, 2))
    if points.ndim != 2 or points.shape[1] != 2:
        raise BadInputError(f"{name} has shape {points.shape}: it must be a list of pairs (x, y)")
    return points[np.isfinite(points).all(1)]
