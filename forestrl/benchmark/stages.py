"""What is timed: each stage is prepared here and has a call that runs it once.

The pipeline of a training, by the time of a collected frame:

* **env step**: trunks, motion, LiDAR and coverage of the bare forest, with TorchRL's own step;
* **+ filter**, **+ graph**, **+ reward**: the same step with one more transform each time, timed as
  a whole; what a stage adds is the difference to the one before;
* **policy forward**: the actor, with the sampled action and its log-probability;
* **GAE**: the critic on a whole batch and its last states, then the advantages;
* **PPO minibatches**: loss, gradient and Adam step of the minibatches that a frame goes through,
  one an epoch;
* **train iteration**: collecting a batch, with resets, staggered episodes and TorchRL's collector,
  and the whole update: about the sum of the last env stage and of the stages behind it.

Beside it stand the **evaluation step**, which is policy, env step and the passage to the next
state, without the record kept of it; and the **decision** of one robot, from an observation to an
action without gradient or TensorDict; **+ filter** with the feasible actions and Algorithm 1;
**from the map**, all that :class:`forestrl.planner.CellPlanner` does.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor
from torchrl.envs import Compose, EnvBase, TransformedEnv
from torchrl.envs.utils import ExplorationType, set_exploration_type

from forestrl import functional as F
from forestrl import keys as K
from forestrl.benchmark.measuring import Stage
from forestrl.benchmark.states import enter
from forestrl.learning.collector import ArenaCollector
from forestrl.learning.metrics import summarize
from forestrl.learning.ppo import PPO
from forestrl.planner import CellPlanner
from forestrl.policies.actor_critic import ActorCritic


@dataclass(frozen=True)
class Setup:
    """What one kind of arena and number of them is measured with.

    Attributes:
        training: the env as training sees it.
        transforms: names of its first transforms, up to the reward.
        networks: actor and critic.
        ppo: learns with these networks.
        make_collector: makes what collects in training; None if the arenas do not divide a batch.
        planner: decides for one robot; None if the observation cannot be made outside an env.
    """

    training: TransformedEnv
    transforms: Sequence[str]
    networks: ActorCritic
    ppo: PPO
    make_collector: Callable[[], ArenaCollector] | None
    planner: CellPlanner | None

    def envs(self) -> dict[str, EnvBase]:
        """Returns envs by stage, each with one transform more; "+ graph" is that of evaluation."""
        forest, transforms = self.training.base_env, list(self.training.transform)
        return {"env step": forest} | {
            name: TransformedEnv(forest, Compose(*(each.clone() for each in transforms[:count])))
            for count, name in enumerate(self.transforms, 1)
        }


def steps(setup: Setup, batches: Sequence[TensorDict]) -> list[Stage]:
    """Prepares a step of each env, of the policy and, last, of evaluation; for all arenas."""
    actor, policy, envs = setup.ppo.actor, setup.networks.make_policy(), setup.envs()
    entered = {name: [enter(env, batch) for batch in batches] for name, env in envs.items()}
    seen = entered["+ graph"]

    def evaluate(state: TensorDictBase) -> TensorDictBase:
        env, uniform = envs["+ graph"], torch.rand(state.batch_size, device=state.device)
        return env.step_mdp(env.step(policy(state.copy().set(K.UNIFORM, uniform))))

    def env_step(env: EnvBase, state: TensorDictBase) -> TensorDictBase:
        return env.step(state.copy())

    calls = {name: _in_turn(partial(env_step, env), entered[name]) for name, env in envs.items()}
    sample = set_exploration_type(ExplorationType.RANDOM)(actor)
    calls["policy forward"] = _in_turn(sample, [td.select(*actor.in_keys) for td in seen])
    calls["evaluation step"] = _in_turn(evaluate, seen)
    return [Stage(name, len(seen[0]), torch.no_grad()(call)) for name, call in calls.items()]


def learning_stages(setup: Setup, worlds: TensorDict) -> Iterator[Stage]:
    """Prepares GAE, minibatches and a whole iteration; the next when the one before was timed."""
    ppo = setup.ppo
    if setup.make_collector is None:
        return
    collector = setup.make_collector()
    collector.arenas = enter(setup.training, worlds).exclude(K.ACTION)
    collected = iter(collector)
    batch = next(collected)
    ppo.estimate_advantage(batch)
    yield Stage("GAE", ppo.frames_per_batch, lambda: ppo.estimate_advantage(batch))
    frames = batch.select(*ppo.learns_from).reshape(-1)
    minibatches = frames[torch.randperm(len(frames))].split(ppo.minibatch_size)
    once = ppo.minibatch_size / ppo.num_epochs  # a frame goes through one in every epoch
    yield Stage("PPO minibatches", once, _in_turn(ppo.step, minibatches))

    def iterate() -> None:
        batch = next(collected)
        summarize(batch, setup.training.transform) | ppo.update(batch)

    yield Stage("train iteration", ppo.frames_per_batch, iterate)
    collector.shutdown()


def decisions(setup: Setup, batches: Sequence[TensorDict]) -> list[Stage]:
    """Prepares single decisions in arenas of one."""
    actor, keys, env = setup.networks.actor, setup.ppo.actor.in_keys, setup.envs()["+ graph"]
    states = [enter(env, batch)[0] for batch in batches]
    maps = [(td[K.CELLS], td[K.POSITION]) for td in states]
    seen = list(zip(([td[key] for key in keys] for td in states), maps, strict=True))

    @torch.no_grad()
    def decide(given: tuple[list[Tensor], Any]) -> Tensor:
        return actor(*given[0]).argmax(-1)

    def decide_safely(given: tuple[list[Tensor], Any]) -> Tensor:
        return F.safe_action(decide(given), F.feasible(*given[1]))

    calls = {"decision": _in_turn(decide, seen), "decision + filter": _in_turn(decide_safely, seen)}
    if (planner := setup.planner) is not None:
        calls["decision from the map"] = _in_turn(lambda given: planner.decide(*given), maps)
    return [Stage(name, 1, call) for name, call in calls.items()]


def _in_turn(function: Callable[[Any], object], inputs: Sequence[Any]) -> Callable[[], object]:
    """Calls a function with the next input every time, so that none stays in the caches."""
    ring = itertools.cycle(inputs)
    return lambda: function(next(ring))
