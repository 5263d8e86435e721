"""Small envs and given worlds to test with."""

from __future__ import annotations

from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor
from torchrl.envs import Compose, EnvBase, Transform, TransformedEnv

from forestrl import keys as K
from forestrl.envs import (
    ExplorationGraph,
    ForestEnv,
    FrontierPotentialReward,
    RandomForest,
    SafetyFilter,
)
from tests.drawing import world

SIZE = 9
MAX_FRONTIERS = 24
CORRIDOR = """
    A . . .
    T T T T
    T T T T
    T T T T
"""


def make_forest(**options: Any) -> ForestEnv:
    """A small forest with thin trunks."""
    return forest_env(**{"size": SIZE, "n_trees": 8, "tree_radius": (0.5, 1.0)} | options)


def forest_env(
    size: int | tuple[int, int] = 50,
    n_trees: int = 45,
    tree_radius: tuple[float, float] = (1.0, 3.0),
    **options: Any,
) -> ForestEnv:
    """A forest of any size; the same one every time unless a seed is given."""
    world = RandomForest(size, n_trees, tree_radius)
    return ForestEnv(world, **{"seed": 0} | options)


def paper_transforms(**options: Any) -> list[Transform]:
    """The paper's chain, with a graph of a size for small arenas."""
    graph = ExplorationGraph(max_frontiers=MAX_FRONTIERS)
    return [SafetyFilter(), graph, FrontierPotentialReward(**options)]


def make_transformed(**options: Any) -> TransformedEnv:
    return TransformedEnv(make_forest(**options), Compose(*paper_transforms()))


def env_for(drawing: str, *transforms: Transform, **options: Any) -> tuple[EnvBase, TensorDictBase]:
    """An env of the drawing's size with the first state of an episode in the drawn world."""
    trees, position = world(drawing)
    env: EnvBase = forest_env(**{"size": tuple(trees.shape), "n_trees": 0} | options)
    if transforms:
        env = TransformedEnv(env, Compose(*transforms))
    return env, env.reset(given(env, trees, position), set_state=True)


def given(env: EnvBase, trees: Tensor, position: Tensor | None = None) -> TensorDictBase:
    """What ``env.reset`` takes to start in a world of one's own."""
    td = TensorDict({K.TREES: trees}, batch_size=env.batch_size)
    if position is not None:
        td[K.POSITION] = position
    return td


def step(env: EnvBase, td: TensorDictBase, action: int) -> TensorDictBase:
    """One step; the state after it, with the reward."""
    td = td.clone()
    td["action"] = torch.full(env.batch_size, action)
    return env.step(td)["next"]


def leaves(td: TensorDictBase) -> dict[Any, Tensor]:
    return dict(td.items(include_nested=True, leaves_only=True))


def assert_same_state(ours: TensorDictBase, theirs: TensorDictBase) -> None:
    """The same keys with the same values, bit by bit."""
    ours, theirs = leaves(ours), leaves(theirs)
    assert ours.keys() == theirs.keys()
    for key, value in ours.items():
        assert torch.equal(value, theirs[key]), key
