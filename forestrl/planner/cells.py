"""A decision on cells: from a robot's own map and cell to a safe action, without env."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor

from forestrl import functional as F
from forestrl import keys as K
from forestrl.status import Status

Module = Callable[[TensorDictBase], TensorDictBase]


@dataclass(frozen=True)
class Step:
    """What the robot is to do next, in cells."""

    action: int
    """The feasible action to execute, ``u^sigma`` (Table I)."""
    proposed: int
    """The policy's own action, ``u^pi``; another one if the filter stepped in."""
    probabilities: tuple[float, ...] | None
    """Of the nine actions; None for a policy without logits."""
    status: Status | None
    """Whether, and why, a classical planner stays; None for a policy that does not say."""
    goal: tuple[int, int] | None
    """The cell (row, col) that the policy is heading for; None for a policy that has none."""

    @property
    def intervened(self) -> bool:
        """Whether the safety filter replaced the action."""
        return self.action != self.proposed


class CellPlanner:
    """Decides step by step for one robot: observation, policy, safety filter (Algorithm 1).

    What the policy remembers from one step to the next is kept under ``state``: use one planner a
    robot, and :meth:`reset` it where something new begins.

    Args:
        policy: a learned policy or a classical planner: writes ``"action"``.
        observe: writes what the policy reads besides the map; None if that is nothing.
        generator: of the draws that a stochastic policy samples with; None for torch's own.

    Examples:
        >>> from forestrl.planners import PathGain
        >>> cells = torch.ones(5, 5, dtype=torch.uint8)  # all free but
        >>> cells[:, 4] = F.Cell.UNKNOWN  # one side that was not seen yet
        >>> CellPlanner(PathGain()).decide(cells, (2, 2)).status.name
        'EXPLORING'
    """

    def __init__(
        self,
        policy: Module,
        observe: Module | None = None,
        generator: torch.Generator | None = None,
    ) -> None:
        self.policy, self.observe, self.generator = policy, observe, generator
        self.reset()

    def reset(self) -> None:
        """Forgets all earlier steps."""
        self.state: TensorDictBase = TensorDict()

    @torch.no_grad()
    def decide(self, cells: Tensor, position: Sequence[int]) -> Step:
        """Takes the next decision.

        Args:
            cells: the robot's own map, ``Cell`` values, uint8 ``[H, W]``.
            position: its cell, (row, col).

        Raises:
            ValueError: if the cell is not one of the map's, or the policy is broken.
        """
        place = torch.as_tensor(position)
        if not F.inside(place, (cells.shape[0], cells.shape[1])):
            raise ValueError(
                f"position={tuple(place.tolist())} is not a cell of {list(cells.shape)}"
            )
        state = self.state.update({K.CELLS: cells, K.POSITION: place})
        if self.generator is not None:
            state[K.UNIFORM] = torch.rand((), generator=self.generator)
        if self.observe is not None:
            state = self.observe(state)
        state = self.policy(state)
        self.state = state
        proposed = state[K.ACTION]
        action = F.safe_action(proposed, F.feasible(cells, place))
        logits, status = state.get(K.LOGITS, None), state.get(K.STATUS, None)
        row, col = state[K.TARGET].tolist() if K.TARGET in state.keys(True) else (-1, -1)
        return Step(
            action=int(action),
            proposed=int(proposed),
            probabilities=None if logits is None else tuple(logits.softmax(-1).tolist()),
            status=None if status is None else Status(int(status)),
            goal=None if row < 0 else (row, col),
        )
