"""PPO learns: one minute, one small empty arena."""

import pytest

from forestrl import build
from forestrl.evaluation import evaluate
from forestrl.planners import RandomWalk
from forestrl.released import learned_policy
from tests.commands import compose, train

ARENA = ("env.size=10", "env.n_trees=0", "env.lidar_range=2.0")
STEPS, ARENAS, MARGIN = 40, 100, 0.2


def coverage(policy):
    """Mean coverage at step 40 of arenas that the training did not see."""
    cfg = compose("train", "experiment=smoke", *ARENA)
    episodes = evaluate(
        lambda n: build.make_env(cfg, num_envs=n),
        policy,
        seed=7,
        indices=range(ARENAS),
        steps=STEPS,
        batch=ARENAS,
    )
    return episodes.coverage[:, -1].mean()


@pytest.mark.slow
def test_a_short_training_beats_the_random_walk(tmp_path):
    run = train(
        tmp_path / "run",
        *ARENA,
        "env.num_envs=8",
        "total_frames=16384",
        "eval.every=0",
        "checkpoint_every=16384",
        "algo.num_epochs=4",
        "algo.lr=1e-3",
    )
    learned = learned_policy(run)
    assert coverage(learned) > coverage(RandomWalk()) + MARGIN
