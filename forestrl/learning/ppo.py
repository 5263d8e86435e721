"""Proximal policy optimisation with the paper's schedule (Table III)."""

from __future__ import annotations

from typing import Annotated

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModule
from torch import Tensor, nn
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

from forestrl.settings import Range, checked, not_allowed

_LEAST_DECAY = 1e-6  # of gamma times lambda; TorchRL's vectorised GAE has no room for less
_TARGETS = ("action", "action_log_prob", "advantage", "value_target", "state_value")


class PPO:
    """Updates actor and critic from one batch of experience at a time.

    Advantages are estimated once a batch by GAE and normalised over it; then every epoch shuffles
    the batch anew and takes one Adam step a minibatch. A truncated episode bootstraps from its last
    state.

    Args:
        actor: writes ``"action"`` and ``"action_log_prob"``; reads its ``in_keys``.
        critic: writes ``"state_value"``; reads its ``in_keys``.
        frames_per_batch: frames an update learns from, counted over all arenas ("rollouts").
        num_minibatches: minibatches an epoch.
        num_epochs: passes over a batch.
        lr: Adam's learning rate.
        gamma: discount factor.
        gae_lambda: lambda of the generalised advantage estimate.
        clip_epsilon: clipping parameter of the probability ratio.
        critic_coeff: weight of the squared value error.
        entropy_coeff: weight of the entropy bonus.
        max_grad_norm: bound on the norm of the gradient of both networks together.

    Raises:
        ValueError: if ``num_minibatches`` does not divide ``frames_per_batch``, or a value is out
            of its range.
    """

    @checked
    def __init__(
        self,
        actor: TensorDictModule,
        critic: TensorDictModule,
        *,
        frames_per_batch: Annotated[int, Range(2, 1_000_000)] = 1024,
        num_minibatches: Annotated[int, Range(1, 1_000_000)] = 64,
        num_epochs: Annotated[int, Range(1, 1000)] = 8,
        lr: Annotated[float, Range(above=0, high=1)] = 3e-4,
        gamma: Annotated[float, Range(0, 1)] = 0.99,
        gae_lambda: Annotated[float, Range(0, 1)] = 0.95,
        clip_epsilon: Annotated[float, Range(above=0, high=10)] = 0.2,
        critic_coeff: Annotated[float, Range(0, 1000)] = 1.0,
        entropy_coeff: Annotated[float, Range(0, 1000)] = 0.02,
        max_grad_norm: Annotated[float, Range(above=0)] = 0.5,
    ) -> None:
        if frames_per_batch % num_minibatches:
            reason = f"it must divide frames_per_batch={frames_per_batch}"
            raise not_allowed("num_minibatches", num_minibatches, reason)
        self.actor, self.critic = actor, critic
        self.frames_per_batch, self.num_epochs = frames_per_batch, num_epochs
        self.max_grad_norm = max_grad_norm
        # The values are computed here, so that each state passes through the critic once.
        self.advantage = GAE(
            gamma=gamma,
            lmbda=gae_lambda,
            value_network=None,
            average_gae=True,
            vectorized=gamma * gae_lambda > _LEAST_DECAY,
        )
        self.loss = ClipPPOLoss(
            actor,
            critic,
            clip_epsilon=clip_epsilon,
            critic_coeff=critic_coeff,
            entropy_bonus=True,
            entropy_coeff=entropy_coeff,
            loss_critic_type="l2",
            log_explained_variance=False,
            functional=False,
        )
        self.parameters = [*actor.parameters(), *critic.parameters()]
        self.optimizer = torch.optim.Adam(self.parameters, lr=lr, fused=True)
        self.minibatch_size = frames_per_batch // num_minibatches
        self.learns_from = list(dict.fromkeys((*actor.in_keys, *critic.in_keys, *_TARGETS)))

    def update(self, batch: TensorDictBase) -> dict[str, float]:
        """Learns from one batch of experience.

        Args:
            batch: what a collector returns, ``[*B, T]`` frames, time last.

        Returns:
            the mean over all minibatches of each part of the loss and of its diagnostics.

        Raises:
            NotFiniteError: if a reward, a value, a part of the loss, the gradient or a weight is
                infinite or no number; the networks are no longer of use then.
        """
        self.estimate_advantage(batch)
        _require_finite({name: batch[key].abs().max() for name, key in _CHECKED.items()}, batch)
        frames = batch.select(*self.learns_from).reshape(-1)
        # One order too many is drawn: it is what earlier runs with the same seed did.
        *orders, _ = [torch.randperm(len(frames)) for _ in range(self.num_epochs + 1)]
        minibatches = (each for o in orders for each in frames[o].split(self.minibatch_size))
        measured = [self.step(minibatch) for minibatch in minibatches]
        weights = torch.stack([weight.detach().abs().max() for weight in self.parameters]).max()
        _require_finite({"weights": weights}, batch)
        means = torch.stack(measured).mean(0).tolist()
        metrics = dict(zip(_MEASURED.values(), means, strict=True))
        return metrics | {"ppo/explained_variance": explained_variance(batch)}

    @torch.no_grad()
    def estimate_advantage(self, batch: TensorDictBase) -> None:
        """Adds ``"state_value"``, ``"advantage"`` and ``"value_target"`` to a batch.

        The value of a next state is the next frame's, except where an episode or the batch ends.
        """
        time = batch.ndim - 1
        value = self._value(batch)
        next_value = torch.cat(
            (value.narrow(time, 1, value.shape[time] - 1), value[..., -1:, :]), time
        )
        ends = batch["next", "done"].squeeze(-1).clone()
        ends[..., -1] = True
        next_value[ends] = self._value(batch["next"].select(*self.critic.in_keys)[ends])
        batch["state_value"], batch["next", "state_value"] = value, next_value
        self.advantage(batch)

    def _value(self, states: TensorDictBase) -> Tensor:
        return self.critic(states.select(*self.critic.in_keys))["state_value"]

    def step(self, minibatch: TensorDictBase) -> Tensor:
        """Takes one Adam step; returns what ``_MEASURED`` lists, float32 ``[n]``."""
        losses = self.loss(minibatch)
        losses.setdefault("loss_critic", losses["loss_objective"].new_zeros(()))  # if it weighs 0
        self.optimizer.zero_grad()
        (losses["loss_objective"] + losses["loss_critic"] + losses["loss_entropy"]).backward()
        losses["grad_norm"] = nn.utils.clip_grad_norm_(self.parameters, self.max_grad_norm)
        measured = torch.stack([losses[key].detach() for key in _MEASURED])
        if not measured.isfinite().all():
            _require_finite(dict(zip(_MEASURED.values(), measured, strict=True)), minibatch)
        self.optimizer.step()
        return measured


_MEASURED = {
    "loss_objective": "loss/objective",
    "loss_critic": "loss/critic",
    "entropy": "loss/entropy",
    "kl_approx": "ppo/kl_approx",
    "clip_fraction": "ppo/clip_fraction",
    "grad_norm": "ppo/grad_norm",
}


_CHECKED = {
    "reward": ("next", "reward"),
    "the critic's value": "state_value",
    "the advantage": "advantage",
}


class NotFiniteError(ValueError):
    """A number that is infinite or none at all.

    Attributes:
        batch: in which it appeared.
    """

    def __init__(self, message: str, batch: TensorDictBase) -> None:
        super().__init__(message)
        self.batch = batch


def _require_finite(values: dict[str, Tensor], batch: TensorDictBase) -> None:
    for name, value in values.items():
        if not value.isfinite():
            raise NotFiniteError(f"{name} is {float(value)}", batch)


def explained_variance(batch: TensorDictBase) -> float:
    """Gives the share of the value targets' variance that the critic explained beforehand."""
    target, value = batch["value_target"], batch["state_value"]
    return float(1 - (target - value).var() / target.var().clamp_min(1e-8))
