"""What is timed: each function prepares a stage and returns a call that runs it once.

The pipeline of a training is, in this order:

* **env step**: trunks, motion, LiDAR and coverage of the bare forest, with TorchRL's own step;
* **+ filter**, **+ graph**, **+ reward**: the same step with one more transform each time, timed as
  a whole; what a stage adds is the difference to the one before;
* **policy forward**: the actor on the graphs, with the sampled action and its log-probability;
* **GAE**: the critic on a whole batch and its last states, then the advantages;
* **PPO minibatch**: the loss of a shuffled minibatch, its gradient and one Adam step.

Beside it stand **train iteration**, which is collecting a batch (with resets, staggered episodes
and TorchRL's collector) and the whole update; **evaluation step**, which is policy, env step and
the passage to the next state, without the record kept of it; and **decision**, from one graph to
one action without gradient or TensorDict, alone and with the filter's feasible actions and
Algorithm 1 behind it; **graph to filter** also builds the graph from the map, which is all that a
robot does for a step.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor
from torchrl.envs import EnvBase
from torchrl.envs.utils import ExplorationType, set_exploration_type

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.benchmark.states import enter
from forestrl.envs import ExplorationGraph
from forestrl.learning.collector import ArenaCollector
from forestrl.learning.ppo import PPO
from forestrl.policies.actor_critic import ActorCritic

T = TypeVar("T")
Call = Callable[[], object]

POLICY, ADVANTAGE, MINIBATCH = "policy forward", "GAE", "PPO minibatch"
LEARNING = (POLICY, ADVANTAGE, MINIBATCH)
"""The pipeline's stages behind those of the envs."""
ITERATION, EVALUATION = "train iteration", "evaluation step"
DECISION, SAFE_DECISION = "decision", "decision + filter"
MAP_DECISION = "graph to filter"


@dataclass(frozen=True)
class Parts:
    """What one size and number of arenas is measured with.

    Attributes:
        envs: envs by the name of their stage, each with one transform more than the one before.
        evaluation: the env as evaluation sees it.
        networks: actor and critic.
        ppo: learns with these networks.
        make_collector: makes what collects in training; None if the arenas do not divide a batch.
    """

    envs: dict[str, EnvBase]
    evaluation: EnvBase
    networks: ActorCritic
    ppo: PPO
    make_collector: Callable[[], ArenaCollector] | None


def env_step(env: EnvBase, worlds: Sequence[TensorDict]) -> Call:
    """Steps all arenas of an env once."""

    @torch.no_grad()
    def step(state: TensorDictBase) -> TensorDictBase:
        return env.step(state.copy())

    return _in_turn(step, [enter(env, world) for world in worlds])


def policy_forward(parts: Parts, worlds: Sequence[TensorDict]) -> Call:
    """Decides for all arenas as the collector does."""

    @torch.no_grad()
    @set_exploration_type(ExplorationType.RANDOM)
    def forward(state: TensorDictBase) -> TensorDictBase:
        return parts.ppo.actor(state)

    return _in_turn(forward, _graphs(parts, worlds))


def evaluation_step(parts: Parts, worlds: Sequence[TensorDict]) -> Call:
    """Decides for, steps and passes on all arenas as evaluation does."""
    policy, env = parts.networks.make_policy(), parts.evaluation

    @torch.no_grad()
    def step(state: TensorDictBase) -> TensorDictBase:
        uniform = torch.rand(state.batch_size, device=state.device)
        return env.step_mdp(env.step(policy(state.copy().set(K.UNIFORM, uniform))))

    return _in_turn(step, [enter(env, world) for world in worlds])


def advantage(ppo: PPO, batch: TensorDictBase) -> Call:
    """Estimates the advantages of one batch of experience."""
    return lambda: ppo.estimate_advantage(batch)


def minibatch(ppo: PPO, batch: TensorDictBase) -> Call:
    """Learns from one shuffled minibatch after the other."""
    ppo.estimate_advantage(batch)
    frames = batch.select(*ppo.learns_from).reshape(-1)
    return _in_turn(ppo.step, frames[torch.randperm(len(frames))].split(ppo.minibatch_size))


def start_collecting(collector: ArenaCollector, worlds: TensorDict) -> None:
    """Puts the arenas of a collector into explored worlds."""
    collector.arenas = enter(collector.env, worlds).exclude(K.ACTION)


def decision(parts: Parts, worlds: Sequence[TensorDict]) -> dict[str, Call]:
    """Goes from one graph to one action: without the filter, and with it.

    Args:
        parts: those of one arena.
        worlds: one arena each.
    """
    graphs = [tuple(state[key][0] for key in K.GRAPH) for state in _graphs(parts, worlds)]
    (observe,) = (t for t in parts.evaluation.transform if isinstance(t, ExplorationGraph))
    maps = [(world["cells"][0], world["position"][0]) for world in worlds]

    @torch.no_grad()
    def decide(graph: tuple[Tensor, ...]) -> Tensor:
        return parts.networks.actor(*graph).argmax(-1)

    def decide_safely(given: tuple[tuple[Tensor, ...], tuple[Tensor, Tensor]]) -> Tensor:
        graph, (cells, position) = given
        return F.safe_action(decide(graph), F.feasible(cells, position))

    def decide_from_map(given: tuple[Tensor, Tensor]) -> Tensor:
        graph = kernels.exploration_graph(
            *given,
            window=observe.window,
            max_frontiers=observe.max_frontiers,
            lidar_range=observe.lidar_range,
        )
        return decide_safely((graph, given))

    together = list(zip(graphs, maps, strict=True))
    return {
        DECISION: _in_turn(decide, graphs),
        SAFE_DECISION: _in_turn(decide_safely, together),
        MAP_DECISION: _in_turn(decide_from_map, maps),
    }


def _graphs(parts: Parts, worlds: Sequence[TensorDict]) -> list[TensorDictBase]:
    env = parts.evaluation
    return [enter(env, world).select(*K.GRAPH) for world in worlds]


def _in_turn(function: Callable[[T], object], inputs: Sequence[T]) -> Call:
    """Calls a function with the next input every time, so that none stays in the caches."""
    ring = itertools.cycle(inputs)
    return lambda: function(next(ring))
