"""TorchRL's collector with a state that can be kept: the only room for its private parts."""

from __future__ import annotations

from typing import Any

from tensordict import TensorDict, TensorDictBase
from torchrl.collectors import Collector


class ArenaCollector(Collector):
    """Collects endless batches from arenas whose whole state can be read and put back.

    Args:
        env: the training env.
        actor: writes ``"action"`` and ``"action_log_prob"``.
        frames_per_batch: frames of a batch, counted over all arenas.
    """

    def __init__(self, env: Any, actor: Any, frames_per_batch: int) -> None:
        super().__init__(
            env,
            actor,
            frames_per_batch=frames_per_batch,
            total_frames=-1,
            auto_register_policy_transforms=False,
        )

    @property
    def arenas(self) -> TensorDictBase:
        """The arenas as they stand, from which the next step is taken: ``[*B]``."""
        return self._carrier

    @arenas.setter
    def arenas(self, arenas: TensorDictBase) -> None:
        self._carrier.update(arenas)

    @property
    def state(self) -> dict[str, Any]:
        """What the next batch depends on besides the policy: arenas, counter and generators."""
        return {
            "arenas": dict(self._carrier.flatten_keys("/").items()),
            "frames": self._frames,
            "generator": self.env.base_env.rng.get_state(),
        }

    @state.setter
    def state(self, state: dict[str, Any]) -> None:
        for name, now in self._carrier.flatten_keys("/").items():
            before = state["arenas"].get(name, now)
            if before.shape != now.shape:
                raise ValueError(
                    f"the arenas to go on with have {name} of shape {list(before.shape)}, these "
                    f"have {list(now.shape)}: leave env.size, env.num_envs and the observation's "
                    "settings as they were"
                )
        arenas = TensorDict(state["arenas"], self.env.batch_size)
        self._carrier.update(arenas.unflatten_keys("/"))
        self._frames = state["frames"]
        self.env.base_env.rng.set_state(state["generator"])
