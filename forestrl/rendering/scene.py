"""What a picture shows, read from one state."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase

from forestrl import functional as F
from forestrl import keys as K
from forestrl.status import Status

Cell = tuple[int, ...]


class Scene:
    """One state and, if the policy has seen it, the decision taken in it, as plain numbers.

    Args:
        td: a state without batch dimensions; ``"action"``, ``"logits"``, the filter's and the
            graph's keys are read if they are there.
    """

    def __init__(self, td: TensorDictBase) -> None:
        cells, position = td[K.CELLS], td[K.POSITION]
        feasible = F.feasible(cells, position)
        frontier = F.frontier(cells)
        self.trees, self.cells = td[K.TREES].cpu().numpy(), cells.cpu().numpy()
        self.frontier: list[Cell] = [tuple(cell) for cell in frontier.nonzero().tolist()]
        self.agent: Cell = tuple(position.tolist())
        self.step, self.coverage = int(td[K.STEP_COUNT]), float(td[K.COVERAGE])
        self.feasible: list[bool] = feasible.tolist()
        self.targets: list[Cell] = [tuple(cell) for cell in F.targets(position).tolist()]
        logits, action = td.get(K.LOGITS, None), td.get(K.ACTION, None)
        self.probability = None if logits is None else logits.float().softmax(-1).tolist()
        self.proposed = self.executed = None if action is None else int(action)
        if action is not None and td.get(K.FEASIBLE, None) is not None:
            self.executed = int(F.safe_action(action, feasible))
        status = Status(int(td.get(K.STATUS, torch.tensor(Status.EXPLORING))))
        self.stopped = "" if status == Status.EXPLORING else status.name.lower().replace("_", " ")
        """Why a planner stays where it is, if it does."""
        room = td.get(K.WAYPOINT, None)
        self.has_graph = room is not None
        self.ties: list[tuple[Cell, Cell]] = []
        """Eq. 2's edges: each frontier cell and its waypoint."""
        if room is not None:
            nodes, count = F.nearest_first(frontier, position, room.shape[-1])
            nodes = nodes[: int(count)]
            nearest = F.nearest_waypoint(nodes, position)[0].tolist()
            pairs = zip(nodes.tolist(), nearest, strict=True)
            self.ties = [(tuple(node), self.targets[waypoint]) for node, waypoint in pairs]

    @property
    def intervened(self) -> bool:
        """Whether the safety filter replaces the action."""
        return self.proposed != self.executed

    def strength(self, action: int) -> float | None:
        """Gives an action's probability in units of the likeliest one's, if it is known."""
        if self.probability is None:
            return None
        return self.probability[action] / max(self.probability)
