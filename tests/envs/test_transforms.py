"""The battery: every transform in every place an env can be put, and what its keys look like."""

from __future__ import annotations

import pytest
import torch
from torchrl.envs import Compose, SerialEnv, TransformedEnv
from torchrl.envs.utils import check_env_specs

from forestrl import functional as F
from forestrl import keys as K
from forestrl.envs import ExplorationGraph, FrontierPotentialReward, SafetyFilter
from tests.envs.worlds import MAX_FRONTIERS, make_forest, make_transformed, paper_transforms

NODES = 9 + MAX_FRONTIERS
WRITES = {  # transform: key: shape after the batch, dtype
    "filter": {
        ("safety", "feasible"): ((9,), torch.bool),
        ("safety", "executed"): ((), torch.int64),
        ("safety", "intervened"): ((1,), torch.bool),
    },
    "graph": {
        ("graph", "x"): ((NODES, 8), torch.float32),
        ("graph", "waypoint"): ((MAX_FRONTIERS,), torch.int64),
        ("graph", "length"): ((MAX_FRONTIERS,), torch.float32),
        ("graph", "frontiers"): ((1,), torch.int64),
    },
    "reward": {("exploration", "potential"): ((1,), torch.float32)},
}
WRITES["paper"] = WRITES["filter"] | WRITES["graph"] | WRITES["reward"]


def transforms(name: str) -> Compose:
    chain = paper_transforms()
    return Compose(
        *{"filter": chain[:1], "graph": chain[1:2], "reward": chain[2:]}.get(name, chain)
    )


def forest(num_envs: int | None = None):
    return make_forest(num_envs=num_envs, max_steps=4, lidar_range=2.5)


def transformed(name: str, num_envs: int | None = None):
    return TransformedEnv(forest(num_envs), transforms(name))


PLACES = {  # a transform outside all batching, or inside the workers of a SerialEnv
    "outside-single": lambda name: transformed(name),
    "outside-batched": lambda name: transformed(name, 3),
    "outside-serial": lambda name: TransformedEnv(SerialEnv(2, forest), transforms(name)),
    "inside-single": lambda name: SerialEnv(1, lambda: transformed(name)),
    "inside-batched": lambda name: SerialEnv(2, lambda: transformed(name, 3)),
    "inside-serial": lambda name: SerialEnv(2, lambda: transformed(name)),
}
BATCH = {
    "outside-single": (),
    "outside-batched": (3,),
    "outside-serial": (2,),
    "inside-single": (1,),
    "inside-batched": (2, 3),
    "inside-serial": (2,),
}


def check_values(name: str, steps) -> None:
    """What a transform wrote is what its function says of the map and the position beside it."""
    for state in (steps, steps["next"]):
        cells, position = state[K.CELLS], state[K.POSITION]
        if name in ("filter", "paper"):
            assert torch.equal(state[K.FEASIBLE], F.feasible(cells, position))
        if name in ("graph", "paper"):
            graph = F.exploration_graph(
                cells, position, window=7, max_frontiers=MAX_FRONTIERS, lidar_range=2.5
            )
            for key, expected in zip(WRITES["graph"], graph, strict=True):
                torch.testing.assert_close(state[key], expected, rtol=0, atol=1e-6)
        if name in ("reward", "paper"):
            phi = F.potential(cells, position, window=7, beta=0.5)
            torch.testing.assert_close(state[K.POTENTIAL], phi, rtol=0, atol=1e-6)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", WRITES)
def test_every_transform_works_in_every_place(name, place):
    env, batch = PLACES[place](name), BATCH[place]
    assert env.batch_size == batch
    check_env_specs(env, seed=0)
    torch.manual_seed(0)
    steps = env.rollout(10, break_when_any_done=False)
    assert steps.batch_size == (*batch, 10)
    assert steps["next", "truncated"].any()  # a budget of 4 steps: episodes ended on the way
    for key, (shape, dtype) in WRITES[name].items():
        for state in (steps, steps["next"]):
            assert (state[key].shape, state[key].dtype) == ((*batch, 10, *shape), dtype), key
    check_values(name, steps)
    env.close()


@pytest.mark.parametrize("num_envs", [None, 1, 3])
def test_the_transformed_env_fulfils_its_specs(num_envs):
    env = make_transformed(num_envs=num_envs)
    check_env_specs(env, seed=0)
    batch = () if num_envs is None else (num_envs,)
    for key, (shape, dtype) in WRITES["paper"].items():
        spec = env.observation_spec[key]
        assert (spec.shape, spec.dtype) == ((*batch, *shape), dtype), key
    assert env.reward_spec.shape == (*batch, 1)


def test_the_transformed_env_writes_no_other_keys():
    bare, env = make_forest(), make_transformed()
    added = set(env.observation_spec.keys(True, True)) - set(bare.observation_spec.keys(True, True))
    assert added == set(WRITES["paper"])
    bare_step, env_step = (set(e.rollout(1)["next"].keys(True, True)) for e in (bare, env))
    assert env_step - bare_step == set(WRITES["paper"])


def test_the_constants_of_the_schema_are_the_keys_of_the_transforms():
    names = ["FEASIBLE", "EXECUTED", "INTERVENED", "NODES", "WAYPOINT", "LENGTH", "FRONTIERS"]
    assert {getattr(K, name) for name in [*names, "POTENTIAL"]} == set(WRITES["paper"])
    assert K.UNIFORM == "uniform"


def test_every_value_of_a_rollout_lies_in_its_spec():
    env = make_transformed(num_envs=4, lidar_range=2.5)
    torch.manual_seed(1)
    for td in env.rollout(20, break_when_any_done=False).unbind(-1):
        for state in (td, td["next"]):
            assert env.observation_spec.is_in(state.select(*env.observation_spec.keys()))


@pytest.mark.parametrize("num_envs", [None, 2])
def test_an_ablation_may_leave_out_any_transform(num_envs):
    """Each pair of the three works too; without the reward's transform the reward is n^e."""
    parts = [SafetyFilter, ExplorationGraph, FrontierPotentialReward]
    for left_out in parts:
        chain = [part() for part in parts if part is not left_out]
        env = TransformedEnv(make_forest(num_envs=num_envs), Compose(*chain))
        check_env_specs(env, seed=0)
        steps = env.rollout(5, break_when_any_done=False)
        plain = torch.equal(steps["next", "reward"], steps["next", K.NEW_CELLS])
        assert plain == (left_out is FrontierPotentialReward)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ExplorationGraph(window=4), "window"),
        (lambda: ExplorationGraph(window=0), "window"),
        (lambda: ExplorationGraph(max_frontiers=0), "max_frontiers"),
        (lambda: FrontierPotentialReward(beta=-0.5), "beta"),
        (lambda: FrontierPotentialReward(window=6), "window"),
    ],
)
def test_an_option_out_of_its_range_is_refused_by_name(make, message):
    with pytest.raises(ValueError, match=message):
        make()
