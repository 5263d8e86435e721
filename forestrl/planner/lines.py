"""The planner by lines of JSON: a request a line in, an answer a line out. See docs/robots.md."""

from __future__ import annotations

import base64
import binascii
import json
from dataclasses import asdict
from typing import Any

import numpy as np

from forestrl.planner.grid import BadInputError
from forestrl.planner.planner import Planner

SCHEMA = 1
_FIELDS = {
    "plan": {"grid", "pose", "scan", "time"},
    "reject": {"goal", "time"},
    "start": set(),
    "stop": set(),
    "resume": set(),
    "state": set(),
    "restore": {"state"},
}


class Lines:
    """Answers requests; whatever a line holds, there is an answer.

    Args:
        planner: of the robot.
    """

    def __init__(self, planner: Planner) -> None:
        self.planner, self._grid = planner, None

    def answer(self, line: str) -> str:
        """Answers a line with a line; the answer to a request that is none has an ``error``.

        >>> Lines(Planner("path_gain")).answer("nonsense")[:34]
        '{"schema": 1, "id": null, "error":'
        """
        said: dict[str, Any] = {"schema": SCHEMA, "id": None}
        try:
            request = json.loads(line)
            if not isinstance(request, dict):
                raise BadInputError("the line is no JSON object")
            said["id"] = request.get("id")
            said |= self._answered(request)
        except (ValueError, RecursionError) as error:
            said["error"] = " ".join(str(error).split())
        return json.dumps(said)

    def _answered(self, request: dict[str, Any]) -> dict[str, Any]:
        kind, schema = request.get("type", "plan"), request.get("schema", SCHEMA)
        if schema != SCHEMA or isinstance(schema, bool):
            raise BadInputError(f"schema={schema!r:.40} is not allowed: it must be {SCHEMA}")
        if not isinstance(kind, str) or kind not in _FIELDS:
            raise BadInputError(
                f"type={kind!r:.40} is not allowed: it must be one of {', '.join(_FIELDS)}"
            )
        given = {name: value for name, value in request.items() if name not in _HEAD}
        if unknown := sorted(given.keys() - _FIELDS[kind]):
            raise BadInputError(f"{unknown[0]:.40} is no field of a {kind} request")
        if kind == "plan":
            return self._planned(**given)
        if kind == "state":
            return {"state": self.planner.state()}
        result = getattr(self.planner, kind)(**given)
        if kind == "start":
            self._grid = None
        return {"set_aside": result} if kind == "reject" else {"done": kind}

    def _planned(
        self, grid: Any = None, pose: Any = None, scan: Any = None, time: Any = None
    ) -> dict[str, Any]:
        """Plans on the grid of the request, or on the last one that there was."""
        grid = self._grid if grid is None else _decoded(grid)
        decision = self.planner.plan(grid, pose, scan=scan, time=time)
        self._grid = grid
        return {**asdict(decision), "intervened": decision.intervened}


_HEAD = {"schema", "id", "type"}


def _decoded(grid: Any) -> Any:
    """Reads the bytes of a grid whose data is text: int8 values as base64."""
    if not isinstance(grid, dict) or not isinstance(grid.get("data"), str):
        return grid
    try:
        values = np.frombuffer(base64.b64decode(grid["data"], validate=True), np.int8)
    except (binascii.Error, ValueError) as error:
        raise BadInputError(f"data is no base64: {error}") from error
    return {**grid, "data": values}
