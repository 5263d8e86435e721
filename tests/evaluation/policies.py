"""Stand-ins for policies, and the envs they run in."""

import torch
from torchrl.envs import Compose, TransformedEnv

from forestrl import keys as K
from forestrl.envs import ExplorationGraph, SafetyFilter
from tests.envs.worlds import forest_env


def forest(n, *, size=16, n_trees=6, graph=True, max_frontiers=64, **options):
    """A forest of ``n`` arenas with the filter and, if asked for, the graph."""
    transforms = [SafetyFilter()] + [ExplorationGraph(max_frontiers=max_frontiers)] * graph
    env = forest_env(size=size, n_trees=n_trees, num_envs=n, **options)
    return TransformedEnv(env, Compose(*transforms))


def meadow(n):
    """A bare env without trees: what happens in it can be worked out by hand."""
    return TransformedEnv(forest_env(size=9, n_trees=0, num_envs=n))


def random_action(td):
    """Any of the nine actions, as the uniform draw has it."""
    return td.set(K.ACTION, (td[K.UNIFORM] * 9).long().clamp(max=8))


def random_logits(td):
    """A small fixed network's actions, sampled by the inverse of their distribution."""
    weight = torch.linspace(-3, 3, 8 * 9).sin().view(8, 9)
    logits = 3 * (td[K.NODES][..., :9, :] * weight.T).sum(-1)
    sums = logits.softmax(-1).cumsum(-1)
    td[K.LOGITS] = logits
    return td.set(K.ACTION, (td[K.UNIFORM].unsqueeze(-1) >= sums).sum(-1).clamp(max=8))


def always(action):
    return lambda td: td.set(K.ACTION, torch.full(td.batch_size, action))
