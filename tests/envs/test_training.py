"""Training episodes: cut short, the first ones at staggered times."""

import pytest
import torch
from torchrl.envs import SerialEnv, TransformedEnv, check_env_specs

from forestrl import keys as K
from forestrl.envs import StaggeredEpisodes
from tests.envs.worlds import make_forest, make_transformed

ARENAS, STEPS = 8, 6


def make_env(seed=0, **options):
    """An env whose agents stay where they are: nothing but time ends an episode."""
    env = make_forest(num_envs=ARENAS, seed=seed, **options)
    return TransformedEnv(env, StaggeredEpisodes(STEPS))


def stay(td):
    return td.set(K.ACTION, torch.zeros(td.batch_size, dtype=torch.int64))


def lengths(env, steps=5 * STEPS):
    """The lengths of the episodes that ended, arena by arena."""
    after = env.rollout(steps, stay, break_when_any_done=False)["next"]
    ends, counts = after["done"].squeeze(-1), after[K.STEP_COUNT].squeeze(-1)
    return [counts[arena][ends[arena]].tolist() for arena in range(ARENAS)]


def test_first_episodes_are_staggered_and_later_ones_full():
    episodes = lengths(make_env())
    first = [arena[0] for arena in episodes]
    assert len(set(first)) > 2 and all(1 <= length <= STEPS for length in first)
    assert all(length == STEPS for arena in episodes for length in arena[1:])
    assert all(len(arena) >= 4 for arena in episodes)


def test_first_horizons_depend_on_the_seed_alone():
    assert lengths(make_env(seed=1)) == lengths(make_env(seed=1))
    assert lengths(make_env(seed=1)) != lengths(make_env(seed=2))


def test_first_horizons_follow_a_seed_that_is_set_later():
    env, other = make_env(seed=1), make_env(seed=2)
    env.reset()
    env.set_seed(2)
    assert env.reset()["horizon"].equal(other.reset()["horizon"])
    env.set_seed(2)
    assert env.reset()["horizon"].equal(other.reset()["horizon"])


def test_episodes_are_staggered_outside_several_envs_too():
    def make():
        return make_forest(num_envs=2)

    env = TransformedEnv(SerialEnv(3, make), StaggeredEpisodes(50))
    assert len(env.reset()["horizon"].unique()) > 2
    env.close()


def test_the_cut_is_a_truncation():
    after = make_env().rollout(2 * STEPS, stay, break_when_any_done=False)["next"]
    assert after["truncated"].any() and not after["terminated"].any()
    assert after["done"].equal(after["truncated"])
    assert after["truncated"].equal(after[K.STEP_COUNT] >= after["horizon"])


def test_done_is_terminated_or_truncated():
    torch.manual_seed(0)
    env = make_env(coverage_goal=0.6)
    after = env.rollout(10 * STEPS, break_when_any_done=False)["next"]
    assert after["terminated"].any() and after["truncated"].any()
    assert after["terminated"].equal(after[K.COVERAGE] >= 0.6)
    assert after["done"].equal(after["terminated"] | after["truncated"])


def test_the_step_budget_of_the_env_still_counts():
    assert max(length for arena in lengths(make_env(max_steps=2)) for length in arena) == 2


def test_an_arena_that_ends_does_not_disturb_the_others():
    env = make_env()
    td = env.reset()
    horizons = td["horizon"].clone()
    for _ in range(STEPS - 1):
        td, following = env.step_and_maybe_reset(stay(td))
        ended = td["next", "done"]
        horizons = torch.where(ended, STEPS, horizons)
        assert following["horizon"].equal(horizons)
        td = following


@pytest.mark.parametrize("num_envs", [None, 3])
def test_specs(num_envs):
    env = make_transformed(num_envs=num_envs)
    env.append_transform(StaggeredEpisodes(STEPS))
    check_env_specs(env)


@pytest.mark.parametrize("steps", [0, -1])
def test_an_episode_has_at_least_one_step(steps):
    with pytest.raises(ValueError, match=f"steps={steps} is not allowed: .* from 1 to"):
        StaggeredEpisodes(steps)
