"""The paper's three contributions as transforms: safety filter, graph observation, reward."""

from __future__ import annotations

import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.data import Binary, Bounded, Categorical, Composite, Unbounded
from torchrl.envs.transforms import Compose, Transform

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K

_WINDOW = 7  # k, Sec. II-B


class SafetyFilter(Transform):
    """Replaces an infeasible action by the nearest feasible one (Algorithm 1).

    On the way in, ``"action"`` becomes ``u^sigma`` for the env while the root TensorDict keeps the
    policy's ``u^pi``, so that log-probabilities and the loss see what the policy chose. On the way
    out it reports what was done.

    Writes ``("safety", "feasible")`` bool ``[*B, 9]``, which actions are feasible from here;
    ``("safety", "executed")`` int64 ``[*B]``, ``u^sigma``; and ``("safety", "intervened")`` bool
    ``[*B, 1]``, ``u^sigma != u^pi``.
    """

    def __init__(self) -> None:
        super().__init__(
            in_keys=[K.CELLS, K.POSITION],
            out_keys=[K.FEASIBLE, K.EXECUTED, K.INTERVENED],
            in_keys_inv=[K.ACTION],
            out_keys_inv=[K.ACTION],
        )

    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        proposed = tensordict[K.ACTION]
        F.check_action(proposed)
        feasible = F.feasible(tensordict[K.CELLS], tensordict[K.POSITION])
        # Set, never written in place: the root shares these tensors.
        tensordict[K.PROPOSED] = proposed
        tensordict[K.ACTION] = F.safe_action(proposed, feasible)
        return tensordict

    def _step(self, tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> TensorDictBase:
        executed = tensordict[K.ACTION]  # u^sigma: this tensordict has been through _inv_call
        return self._report(next_tensordict, executed, executed != tensordict[K.PROPOSED])

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        null = tensordict_reset[K.POSITION][..., 0].new_full(
            tensordict_reset.batch_size, F.NULL_ACTION
        )
        return self._report(tensordict_reset, null, torch.zeros_like(null, dtype=torch.bool))

    def _report(
        self, tensordict: TensorDictBase, executed: Tensor, intervened: Tensor
    ) -> TensorDictBase:
        tensordict[K.FEASIBLE] = F.feasible(tensordict[K.CELLS], tensordict[K.POSITION])
        tensordict[K.EXECUTED] = executed
        tensordict[K.INTERVENED] = intervened.unsqueeze(-1)
        return tensordict

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Declares the three keys.

        Raises:
            ValueError: if a reward inside the env could not see what is replaced out here.
        """
        inside = getattr(self.container, "base_env", None)
        if inside is not None and K.POTENTIAL in inside.observation_spec.keys(True, True):
            raise ValueError(
                "a FrontierPotentialReward inside the env does not see what a SafetyFilter outside "
                "replaces: put both inside or both outside"
            )
        b, n, device = observation_spec.shape, len(F.DISPLACEMENTS), observation_spec.device
        observation_spec[K.FEASIBLE] = Binary(shape=(*b, n), dtype=torch.bool, device=device)
        observation_spec[K.EXECUTED] = Categorical(n, shape=b, device=device)
        observation_spec[K.INTERVENED] = Binary(shape=(*b, 1), dtype=torch.bool, device=device)
        return observation_spec

    def metrics(self, batch: TensorDictBase) -> dict[str, float]:
        """Measures a batch of experience: the share of steps whose action was replaced."""
        return {"safety/intervention_rate": float(batch["next", K.INTERVENED].float().mean())}


class ExplorationGraph(Transform):
    """Observes the agent's map as an exploration graph (Eqs. 1 and 2).

    Writes ``("graph", "x")`` float32 ``[*B, 9 + M, 8]``, ``("graph", "waypoint")`` int64
    ``[*B, M]``, ``("graph", "length")`` float32 ``[*B, M]`` and ``("graph", "frontiers")`` int64
    ``[*B, 1]``; see :class:`forestrl.functional.Graph`.

    Args:
        window: ``k``, side of the local window, cells; odd.
        max_frontiers: ``M``, room for frontier nodes; the nearest are kept.
        lidar_range: ``l``, cells, the unit of edge lengths; ``None`` for the env's own.

    Raises:
        ValueError: if ``window`` is even or not positive, or ``max_frontiers`` is less than 1.
    """

    adjustable = ("max_frontiers", "lidar_range")
    """Settings that a trained policy does not depend on."""

    def __init__(
        self, window: int = _WINDOW, max_frontiers: int = 256, lidar_range: float | None = None
    ) -> None:
        check_window(window)
        if max_frontiers < 1:
            raise ValueError(f"max_frontiers={max_frontiers} is not allowed: at least 1 is needed")
        super().__init__(in_keys=[K.CELLS, K.POSITION], out_keys=list(K.GRAPH))
        self.window, self.max_frontiers, self.lidar_range = window, max_frontiers, lidar_range

    def _call(self, next_tensordict: TensorDictBase) -> TensorDictBase:
        graph = kernels.exploration_graph(
            next_tensordict[K.CELLS],
            next_tensordict[K.POSITION],
            window=self.window,
            max_frontiers=self.max_frontiers,
            lidar_range=_setting(self, "lidar_range"),
        )
        for key, value in zip(K.GRAPH, graph, strict=True):
            next_tensordict[key] = value
        return next_tensordict

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Observes a map outside any env, as a robot does; ``lidar_range`` must be given then."""
        return self._call(tensordict)

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        return self._call(tensordict_reset)

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Declares the four keys."""
        b, m, device = observation_spec.shape, self.max_frontiers, observation_spec.device
        area = observation_spec[K.CELLS].shape[-2:].numel()
        nodes = (*b, F.WAYPOINTS + m, F.FEATURES)
        observation_spec[K.NODES] = Bounded(0.0, 1.0, shape=nodes, device=device)
        observation_spec[K.WAYPOINT] = Categorical(F.WAYPOINTS, shape=(*b, m), device=device)
        observation_spec[K.LENGTH] = Bounded(0.0, torch.inf, shape=(*b, m), device=device)
        observation_spec[K.FRONTIERS] = Bounded(
            0, area, shape=(*b, 1), dtype=torch.int64, device=device
        )
        return observation_spec

    def metrics(self, batch: TensorDictBase) -> dict[str, float]:
        """Measures a batch of experience: frontier cells, and graphs without room for all."""
        frontiers = batch[K.FRONTIERS]
        return {
            "graph/frontiers": float(frontiers.float().mean()),
            "graph/truncated": float((frontiers > self.max_frontiers).float().mean()),
        }


class FrontierPotentialReward(Transform):
    """Shapes the reward with the change of the frontier potential (Eqs. 6 to 9).

    Writes ``("exploration", "potential")`` float32 ``[*B, 1]``, ``Phi(s)``, and replaces
    ``"reward"``. An action counts as unsafe if the filter replaced it or if, without a filter, it
    collided.

    Args:
        beta: weight of the information gain against the distance.
        window: ``k``, side of the window the gain is counted in, cells; odd. ``None`` for that of
            the graph in the same env, which is 7 unless it says otherwise.
        coverage_goal: ``rho*``, the coverage that earns ``r_explored``; ``None`` for the env's own.
        r_explored: ``r_exp``.
        r_unsafe: ``r_sigma``.
        shaping: whether the change of the potential is added; without it the potential is only
            reported.

    Raises:
        ValueError: if ``beta`` is negative, or ``window`` even or not positive.
    """

    def __init__(
        self,
        beta: float = 0.5,
        window: int | None = None,
        coverage_goal: float | None = None,
        r_explored: float = 100.0,
        r_unsafe: float = -5.0,
        shaping: bool = True,
    ) -> None:
        if beta < 0:
            raise ValueError(f"beta={beta} is not allowed: it must be 0 or more")
        if window is not None:
            check_window(window)
        super().__init__(in_keys=[K.CELLS, K.POSITION, "reward"], out_keys=[K.POTENTIAL, "reward"])
        self.beta, self.window, self.coverage_goal = beta, window, coverage_goal
        self.r_explored, self.r_unsafe, self.shaping = r_explored, r_unsafe, shaping

    def _potential(self, tensordict: TensorDictBase) -> Tensor:
        return kernels.potential(
            tensordict[K.CELLS],
            tensordict[K.POSITION],
            window=self._window_of_the_graph() if self.window is None else self.window,
            beta=self.beta,
        )

    def _window_of_the_graph(self) -> int:
        beside = getattr(self.container, "transform", self)
        beside = beside if isinstance(beside, Compose) else [beside]
        graphs = [each for each in beside if isinstance(each, ExplorationGraph)]
        return graphs[0].window if graphs else _WINDOW

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        tensordict_reset[K.POTENTIAL] = self._potential(tensordict_reset)
        return tensordict_reset

    def _step(self, tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> TensorDictBase:
        potential = tensordict.get(K.POTENTIAL, None)
        if potential is None:  # stepped from a situation that was written down, not reset
            potential = self._potential(tensordict)
        next_tensordict[K.POTENTIAL] = self._potential(next_tensordict)
        next_tensordict["reward"] = F.reward(
            next_tensordict[K.NEW_CELLS],
            potential,
            next_tensordict[K.POTENTIAL] if self.shaping else potential,
            explored=next_tensordict[K.COVERAGE] >= _setting(self, "coverage_goal"),
            unsafe=next_tensordict[K.COLLISION] | self._intervened(tensordict, next_tensordict),
            r_explored=self.r_explored,
            r_unsafe=self.r_unsafe,
        )
        return next_tensordict

    @staticmethod
    def _intervened(tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> Tensor:
        """Whether a filter replaced the action, be it before or behind this transform or inside."""
        if (proposed := tensordict.get(K.PROPOSED, None)) is not None:
            return (proposed != tensordict[K.ACTION]).unsqueeze(-1)
        return next_tensordict.get(K.INTERVENED, torch.zeros_like(next_tensordict[K.COLLISION]))

    def metrics(self, batch: TensorDictBase) -> dict[str, float]:
        """Splits the mean reward of a batch of experience into Eq. 6's terms; they add up to it."""
        after = batch["next"]
        none = torch.zeros_like(after[K.COLLISION])
        unsafe = after.get(K.INTERVENED, none) | after[K.COLLISION]
        explored = (after[K.COVERAGE] >= _setting(self, "coverage_goal")) & ~unsafe
        shaped = (~unsafe & ~explored).float()
        new_cells = after[K.NEW_CELLS] * shaped
        terms = {
            "new_cells": new_cells,
            "potential": after["reward"] * shaped - new_cells,
            "explored": after["reward"] * explored,
            "unsafe": after["reward"] * unsafe,
        }
        return {f"reward/{name}": float(term.float().mean()) for name, term in terms.items()}

    def transform_observation_spec(self, observation_spec: Composite) -> Composite:
        """Declares the potential."""
        observation_spec[K.POTENTIAL] = Bounded(
            0.0, 1.0, shape=(*observation_spec.shape, 1), device=observation_spec.device
        )
        return observation_spec

    def transform_reward_spec(self, reward_spec: Composite) -> Composite:
        """Declares the reward unbounded."""
        for key in reward_spec.keys(True, True):
            reward_spec[key] = Unbounded(shape=reward_spec[key].shape, device=reward_spec.device)
        return reward_spec


def _setting(transform: Transform, name: str) -> float:
    """Gives a transform's own setting or, where it leaves it open, that of the env it is in.

    Raises:
        ValueError: if it is in no env.
    """
    if (own := getattr(transform, name)) is not None:
        return own
    if (container := transform.container) is None:
        raise ValueError(
            f"{type(transform).__name__} is in no env to take its {name} from: give it"
        )
    env, found = container.base_env, vars(transform).setdefault("_found", {})
    if found.get("env") != id(env):  # asked once: it may be in another process
        value = getattr(env, name)
        found["env"], found[name] = id(env), value[0] if isinstance(value, list) else value
    return found[name]


def check_window(window: int) -> None:
    """Refuses a window without a middle cell."""
    if window < 1 or window % 2 == 0:
        raise ValueError(f"window={window} is not allowed: it must be odd and at least 1")
