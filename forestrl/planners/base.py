"""What the planners share: why they stop, and how a cycle is noticed."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor

from forestrl import functional as F
from forestrl import keys as K
from forestrl.status import Status

Key = str | tuple[str, ...]

_KNOWN, _AGE, _ANCHOR = ("planner", "known"), ("planner", "age"), ("planner", "anchor")


class ClassicalPlanner(TensorDictModuleBase):
    """Plans a step from the map, anew at every step, until there is a reason to stop.

    Writes ``"action"`` and ``("planner", "status")``, int8 ``[*B]``, a :class:`Status`; with any
    status but EXPLORING the agent stays where it is. A call is a step: called twice in the same
    situation, a planner takes it that the agent did not get away.

    What such a planner does depends on position and map only. When both repeat, it goes round for
    ever; and as a map never loses a cell, that is when a position returns while no cell becomes
    known. Brent's algorithm notices it with a few numbers that travel in the TensorDict: how many
    cells are known, the steps since that number changed, and the position at the last of these
    steps that was a power of two. They start afresh where ``"step_count"`` is 0.

    Args:
        reads: keys that :meth:`plan` needs besides the agent's map and position.
        remembers: keys that it writes, and finds again at the next step.
        can_cycle: whether a position that returns shows a cycle; False for a planner that decides
            by what it remembers too, and has a guard of its own.
    """

    def __init__(
        self, reads: Sequence[Key] = (), remembers: Sequence[Key] = (), can_cycle: bool = True
    ) -> None:
        self.in_keys = [K.CELLS, K.POSITION, *reads]
        self.out_keys = [K.ACTION, K.STATUS, _KNOWN, _AGE, _ANCHOR, *remembers]
        super().__init__()
        self.remembers, self.can_cycle = tuple(remembers), can_cycle

    @abstractmethod
    def plan(self, entries: dict[Key, Tensor], changed: Tensor) -> tuple[Tensor, Tensor]:
        """Plans one step in ``n`` arenas.

        Args:
            entries: what ``in_keys`` and ``remembers`` name, on the CPU, with one batch dimension;
                what is remembered is not there at the first step, and is written here.
            changed: whether a cell has become known since the last step, bool ``[n]``; True at
                the first step.

        Returns:
            action, int64 ``[n]``, and :class:`Status`, int8 ``[n]``.
        """

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes action and status."""
        cells, position = tensordict[K.CELLS], tensordict[K.POSITION]
        known = (cells != F.Cell.UNKNOWN).flatten(-2).sum(-1)
        changed, status = self._recall(tensordict, known)
        age, anchor = tensordict.get(_AGE, None), tensordict.get(_ANCHOR, None)
        age = torch.where(changed, 0, known if age is None else age + 1)
        anchor = position if anchor is None else anchor
        returned = ~changed & (position == anchor).all(-1) & (status == Status.EXPLORING)
        if self.can_cycle:
            status = torch.where(returned, int(Status.CYCLE), status)
        status = status.to(torch.int8)
        anchor = torch.where(((age & (age - 1)) == 0).unsqueeze(-1), position, anchor)
        action = torch.full_like(known, F.NULL_ACTION)
        self._plan_the_rest(tensordict, changed, action, status)
        written = {K.ACTION: action, K.STATUS: status, _KNOWN: known, _AGE: age, _ANCHOR: anchor}
        for key, value in written.items():
            tensordict.set(key, value)
        return tensordict

    def _recall(self, tensordict: TensorDictBase, known: Tensor) -> tuple[Tensor, Tensor]:
        """Tells where cells have become known, and gives the status that holds elsewhere."""
        before = tensordict.get(K.STATUS, None)
        if before is None:
            return torch.ones_like(known, dtype=torch.bool), torch.zeros_like(known)
        changed = known != tensordict[_KNOWN]
        steps = tensordict.get(K.STEP_COUNT, None)
        if steps is not None:
            changed = changed | (steps.squeeze(-1) == 0)
        return changed, torch.where(changed, int(Status.EXPLORING), before)

    def _plan_the_rest(
        self, tensordict: TensorDictBase, changed: Tensor, action: Tensor, status: Tensor
    ) -> None:
        """Plans where there is no status to stop yet, writing into ``action`` and ``status``."""
        rest = (status == Status.EXPLORING).reshape(-1).nonzero().squeeze(-1)
        if len(rest) == 0:
            return
        batch = status.dim()

        def chosen(value: Tensor) -> Tensor:
            return value.reshape(-1, *value.shape[batch:])[rest].cpu()

        entries = {
            key: chosen(value)
            for key in (*self.in_keys, *self.remembers)
            if (value := tensordict.get(key, None)) is not None
        }
        found = self.plan(entries, chosen(changed))
        for result, value in zip((action, status), found, strict=True):
            result.view(-1)[rest] = value.to(result.device, result.dtype)
        for key in self.remembers:
            value = entries[key].to(action.device)
            shape = (*action.shape, *value.shape[1:])
            memory = tensordict.get(key, None)
            memory = value.new_zeros(shape) if memory is None else memory
            memory = memory.reshape(-1, *value.shape[1:]).index_copy(0, rest, value)
            tensordict.set(key, memory.view(shape))
