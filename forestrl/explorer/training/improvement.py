"""How a policy improves on the outcomes of its own episodes: careful policy iteration."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from forestrl.explorer.network import ViewpointGATv2
from forestrl.explorer.training.outcomes import NOT_TRIED, Outcomes


@dataclass(frozen=True)
class Fit:
    """How the network is fitted to outcomes.

    Attributes:
        epochs: passes over the states.
        batch: states of a minibatch.
        lr: learning rate (AdamW).
        sharpness: the policy is taken as the softmax of that many times the scores.
        trust: weight of the divergence from the policy that explored.
        clip: largest difference in steps that counts, to either side of a state's median.
    """

    epochs: int = 8
    batch: int = 512
    lr: float = 1e-3
    weight_decay: float = 1e-4
    sharpness: float = 3.0
    trust: float = 0.3
    clip: float = 50.0
    unit: float = 10.0


def normalize(network: ViewpointGATv2, outcomes: Outcomes) -> None:
    """Sets the network's mean and scale of the features to those of the states."""
    values = outcomes.features[outcomes.there].astype(np.float64)
    network.mean.copy_(torch.from_numpy(values.mean(0)))
    network.scale.copy_(torch.from_numpy(values.std(0).clip(1e-3)))


def expected_steps(scores: Tensor, before: Tensor, steps: Tensor, fit: Fit) -> Tensor:
    """Gives the loss: the expected steps, with the divergence from the policy before.

    Both are over the candidates that were tried.

    Args:
        scores: of the network, ``[B, M]``.
        before: of the policy that explored, ``[B, M]``.
        steps: outcomes, ``[B, M]``, ``NOT_TRIED`` elsewhere.
        fit: settings.
    """
    tried = steps != NOT_TRIED
    middle = torch.where(tried, steps, torch.nan).nanmedian(-1, keepdim=True).values
    worse = torch.where(tried, (steps - middle).clamp(-fit.clip, fit.clip), 0) / fit.unit
    log_p, log_q = (
        (fit.sharpness * x).masked_fill(~tried, -1e9).log_softmax(-1) for x in (scores, before)
    )
    p = log_p.exp()
    divergence = torch.where(tried, p * (log_p - log_q), 0).sum(-1)
    return ((p * worse).sum(-1) + fit.trust * divergence).mean()


def improve(
    network: ViewpointGATv2, outcomes: Outcomes, fit: Fit, generator: torch.Generator
) -> ViewpointGATv2:
    """Fits a copy of the network to outcomes of the policy before."""
    network = copy.deepcopy(network).train()
    features, there = torch.from_numpy(outcomes.features), torch.from_numpy(outcomes.there)
    places = torch.from_numpy(outcomes.places)
    before, steps = torch.from_numpy(outcomes.scores), torch.from_numpy(outcomes.steps)
    optimizer = torch.optim.AdamW(network.parameters(), lr=fit.lr, weight_decay=fit.weight_decay)
    for _ in range(fit.epochs):
        for b in torch.randperm(len(steps), generator=generator).split(fit.batch):
            scores = network(features[b], places[b], there[b])
            loss = expected_steps(scores, before[b], steps[b], fit)
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimizer.step()
    return network.eval()
