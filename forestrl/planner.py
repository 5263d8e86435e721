"""The decision of a robot: from its own map and cell to a safe action, without env or collector."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import OBSERVATIONS
from forestrl.policies.files import CheckpointError
from forestrl.released import learned_policy
from forestrl.status import Status


@dataclass(frozen=True)
class Decision:
    """What the robot is to do, and why."""

    action: int
    """The feasible action to execute, ``u^sigma`` (Table I)."""
    proposed: int
    """The policy's own action, ``u^pi``; another one if the filter stepped in."""
    probabilities: tuple[float, ...] | None
    """Of the nine actions; None for a policy without logits."""
    status: Status
    """Whether, and why, a classical planner stays."""

    @property
    def intervened(self) -> bool:
        """Whether the safety filter replaced the action."""
        return self.action != self.proposed


class Planner:
    """Decides step by step for one robot: observation, policy, safety filter (Algorithm 1).

    What the policy remembers from one step to the next is kept here: use one planner a robot, and
    :meth:`reset` it where something new begins.

    Args:
        policy: a learned policy or a classical planner: writes ``"action"``.
        observe: writes what the policy reads besides the map; None if that is nothing.

    Examples:
        >>> cells = torch.ones(5, 5, dtype=torch.uint8)  # all free but
        >>> cells[:, 4] = F.Cell.UNKNOWN  # one side that was not seen yet
        >>> Planner.from_file().decide(cells, (2, 2)).status.name
        'EXPLORING'
    """

    def __init__(
        self,
        policy: Callable[[TensorDictBase], TensorDictBase],
        observe: Callable[[TensorDictBase], TensorDictBase] | None = None,
    ) -> None:
        self.policy, self.observe = policy, observe
        self.reset()

    @classmethod
    def from_file(
        cls,
        checkpoint: str | Path | None = None,
        *,
        lidar_range: float = 5.0,
        deterministic: bool = True,
    ) -> Planner:
        """Makes a planner of a policy file.

        Args:
            checkpoint: a policy file or a run folder; None for the released policy.
            lidar_range: ``l``, cells, of the robot's own sensor.
            deterministic: take the most probable action instead of a sampled one.

        Raises:
            CheckpointError: if there is no such policy, or it cannot be built.
        """
        policy = learned_policy(checkpoint, deterministic, settings={"lidar_range": lidar_range})
        observation = policy.file.observation
        if observation is None:
            return cls(policy)
        if observation.name not in OBSERVATIONS:
            known = ", ".join(OBSERVATIONS)
            raise CheckpointError(
                f"{policy.file.source} reads {observation.name!r}, which is not one of {known}: "
                "build policy and observation yourself and pass them to Planner"
            )
        observe = OBSERVATIONS[observation.name](**observation.settings, lidar_range=lidar_range)
        return cls(policy, observe)

    def reset(self) -> None:
        """Forgets all earlier steps."""
        self._state = TensorDict()

    @torch.no_grad()
    def decide(self, cells: Tensor, position: Sequence[int]) -> Decision:
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
        state = self._state.update({K.CELLS: cells, K.POSITION: place})
        if self.observe is not None:
            state = self.observe(state)
        state = self.policy(state)
        self._state = state
        proposed = state[K.ACTION]
        action = F.safe_action(proposed, F.feasible(cells, place))
        logits = state.get(K.LOGITS, None)
        return Decision(
            action=int(action),
            proposed=int(proposed),
            probabilities=None if logits is None else tuple(logits.softmax(-1).tolist()),
            status=Status(int(state.get(K.STATUS, torch.tensor(Status.EXPLORING)))),
        )
