"""How the explorer learns: episodes as in the env, outcomes, the fit, and going on after a stop."""

import math

import numpy as np
import pytest
import torch

from forestrl import keys as K
from forestrl.envs import ForestEnv, RandomForest
from forestrl.explorer import LinearScore, ViewpointGATv2
from forestrl.explorer.training.improvement import Fit, expected_steps
from forestrl.explorer.training.iteration import PolicyIteration
from forestrl.explorer.training.outcomes import NOT_TRIED, gather
from forestrl.explorer.training.task import Arenas, Task

FOREST = RandomForest(12, 4, (0.8, 1.5))
RANGE, GOAL = 3.0, 0.95


def arenas(n, seed=0):
    trees, starts = FOREST.sample((n,), generator=torch.Generator().manual_seed(seed))
    return Arenas(trees.numpy(), starts.numpy())


def task(seed=0):
    return Task(FOREST, RANGE, GOAL, seed, arenas(20, seed=99))


def network(seed):
    torch.manual_seed(seed)
    made = ViewpointGATv2(RANGE, GOAL, candidates=5, hidden=4, heads=2)
    for last in (made.out, made.skip):
        torch.nn.init.normal_(last.weight, std=0.5)
    return made


@pytest.mark.parametrize("make", [lambda: LinearScore(RANGE, GOAL), lambda: network(1)])
def test_compiled_episodes_take_the_steps_that_the_env_takes(make):
    made, drawn = make(), arenas(12)
    env = ForestEnv(
        world=FOREST, num_envs=12, lidar_range=RANGE, coverage_goal=GOAL, max_steps=10**6
    )
    td = env.reset()
    td["arena", "trees"] = torch.from_numpy(drawn.trees)
    td["agent", "position"] = torch.from_numpy(drawn.starts)
    td = env.reset(td.select(("arena", "trees"), ("agent", "position")), set_state=True)
    policy, steps = made.make_policy(), np.full(12, -1)
    for step in range(400):
        covered = (td[K.COVERAGE].squeeze(-1) >= np.float32(GOAL)).numpy()
        steps[covered & (steps < 0)] = step
        if covered.all():
            break
        td = env.step_mdp(env.step(policy(td)))
    assert (steps >= 0).all()
    np.testing.assert_array_equal(task().steps(made.pack(), drawn), steps)


def test_expected_steps_by_hand():
    """Two candidates of three were tried; the worse takes 20 steps more, which is two units."""
    steps = torch.tensor([[10.0, 30.0, NOT_TRIED]])
    before = torch.tensor([[0.0, 0.0, 9.0]])
    fit = Fit(sharpness=3.0, trust=0.3)
    assert expected_steps(before, before, steps, fit).item() == pytest.approx(1.0)
    scores = torch.tensor([[math.log(3) / 3, 0.0, -4.0]])  # probabilities 3/4 and 1/4
    divergence = 0.75 * math.log(1.5) + 0.25 * math.log(0.5)
    loss = expected_steps(scores, before, steps, fit).item()
    assert loss == pytest.approx(0.5 + 0.3 * divergence, rel=1e-5)
    far = expected_steps(before, before, torch.tensor([[10.0, 900.0, NOT_TRIED]]), fit).item()
    assert far == pytest.approx(2.5)  # no more than fifty steps count


def outcomes(made, drawn, seeds, **options):
    return gather(
        *drawn,
        np.asarray(seeds),
        lidar_range=RANGE,
        weights=made.pack(),
        coverage_goal=GOAL,
        rate=0.4,
        options=3,
        **options,
    )


def test_outcomes_are_of_the_best_candidate_and_of_others():
    made, drawn = network(2), arenas(6)
    found = outcomes(made, drawn, range(6))
    tried = found.steps != NOT_TRIED
    assert len(found.steps) > 20 and set(found.arena) == set(range(6))
    assert (tried.sum(1) == np.minimum(found.there.sum(1), 3)).all()
    assert not (tried & ~found.there).any()
    best = np.where(found.there, found.scores, -np.inf).argmax(1)
    assert tried[np.arange(len(best)), best].all()
    assert (found.steps[tried] > 0).all() and found.steps[tried].std() > 0
    scores = made(*(torch.from_numpy(x) for x in (found.features, found.places, found.there)))
    there = found.there
    np.testing.assert_allclose(scores.detach().numpy()[there], found.scores[there], atol=1e-3)
    again = outcomes(made, drawn, range(6))
    for name, values in found._asdict().items():
        np.testing.assert_array_equal(getattr(again, name), values, err_msg=name)


def test_outcomes_of_an_arena_do_not_depend_on_the_others():
    made, drawn = network(3), arenas(4)
    among = outcomes(made, drawn, range(4))
    alone = outcomes(made, Arenas(drawn.trees[2:3], drawn.starts[2:3]), [2])
    np.testing.assert_array_equal(alone.steps, among.steps[among.arena == 2])


def test_policy_iteration_goes_on_where_it_stopped_and_keeps_what_is_better(tmp_path):
    algo = PolicyIteration(LinearScore(RANGE, GOAL), rounds=2, arenas=200, rate=0.03, epochs=2)

    def start():
        torch.manual_seed(0)
        return ViewpointGATv2(RANGE, GOAL, candidates=5, hidden=2, heads=2)

    (tmp_path / "whole").mkdir()
    whole = list(algo.run(start(), task(), tmp_path / "whole"))
    assert [told.done for told in whole] == [0, 100, 200, 200, 300, 400, 400]
    assert not (tmp_path / "whole/outcomes").exists()
    steps = [told.metrics["eval/steps"] for told in whole if "eval/steps" in told.metrics]
    kept = [told.network for told in whole if told.network is not None]
    measured = [task().steps(made.pack(), task().validation).mean() for made in kept]
    assert measured == [n for i, n in enumerate(steps) if n < min(steps[:i], default=math.inf)]

    (tmp_path / "parts").mkdir()
    first = algo.run(start(), task(), tmp_path / "parts")
    for _ in range(5):  # into the second round
        next(first)
    first.close()
    torn = tmp_path / "parts/outcomes/1-1.npz"
    torn.write_bytes(torn.read_bytes()[:100])
    parts = list(algo.run(start(), task(), tmp_path / "parts"))
    assert [told.metrics for told in parts] == [told.metrics for told in whole]


def test_what_cannot_be_trained_is_refused(tmp_path):
    with pytest.raises(ValueError, match="choose experiment=explorer"):
        next(PolicyIteration(LinearScore()).run(LinearScore(), task(), tmp_path))
    with pytest.raises(ValueError, match="arenas=150 is not allowed"):
        PolicyIteration(LinearScore(), arenas=150)
