"""Test arena i depends on (seed, i) only."""

import time

import pytest
import torch

from forestrl import functional as F
from forestrl import keys as K
from forestrl.evaluation import arenas
from tests.evaluation.policies import forest


def test_an_arena_is_the_same_alone_and_among_others():
    env = forest(1)
    alone, among = arenas.draw_arenas(env, 3, [7]), arenas.draw_arenas(env, 3, range(100))
    assert torch.equal(alone[K.TREES][0], among[K.TREES][7])
    assert torch.equal(alone[K.POSITION][0], among[K.POSITION][7])


def test_draws_are_the_same_alone_and_among_others():
    alone, among = arenas.uniforms(3, [7], 50), arenas.uniforms(3, range(100), 50)
    assert alone.shape == (1, 50) and alone.dtype == torch.float32
    assert torch.equal(alone[0], among[7])


def test_a_longer_row_of_draws_begins_with_the_shorter():
    assert torch.equal(arenas.uniforms(0, [1], 300)[:, :20], arenas.uniforms(0, [1], 20))


def test_draws_are_uniform():
    draws = arenas.uniforms(0, range(200), 500)
    assert ((draws >= 0) & (draws < 1)).all()
    torch.testing.assert_close(draws.mean(), torch.tensor(0.5), rtol=0, atol=0.005)  # sigma 0.0009
    assert torch.unique(draws[:, 0]).numel() == 200  # neighbours are unrelated
    assert torch.corrcoef(draws[:20]).fill_diagonal_(0).abs().max() < 0.25  # sigma 0.045


@pytest.mark.parametrize("other", [(1, 7, "arena"), (0, 8, "arena"), (0, 7, "actions")])
def test_seed_index_and_stream_each_change_the_draws(other):
    first = torch.rand(4, generator=arenas.arena_generator(0, 7, "arena"))
    assert not torch.equal(first, torch.rand(4, generator=arenas.arena_generator(*other)))


def test_the_seeds_of_a_generator_do_not_run_together():
    """(1, 23) and (12, 3) are different arenas."""
    first, second = arenas.arena_generator(1, 23, ""), arenas.arena_generator(12, 3, "")
    assert first.initial_seed() != second.initial_seed()


def test_an_arena_never_changes():
    """Published numbers rest on these arenas: a change is one of the dynamics."""
    assert arenas.arena_generator(0, 0, "arena").initial_seed() == 13809639610004764055


def test_starts_are_in_the_largest_component():
    env = forest(1, size=20, n_trees=20)
    drawn = arenas.draw_arenas(env, 0, range(30))
    largest = F.largest_component(~drawn[K.TREES])
    assert F.gather(largest, drawn[K.POSITION].unsqueeze(-2), outside=False).all()


def test_env_resets_to_the_arenas():
    env = forest(5)
    drawn = arenas.draw_arenas(env, 0, range(5))
    state = env.reset(drawn.clone(), set_state=True)
    assert torch.equal(state[K.TREES], drawn[K.TREES])
    assert torch.equal(state[K.POSITION], drawn[K.POSITION])


@pytest.mark.slow
def test_a_thousand_arenas_are_drawn_in_seconds():
    env = forest(1, size=50, n_trees=45)
    start = time.process_time()
    arenas.draw_arenas(env, 0, range(1000))
    assert time.process_time() - start < 5  # 0.6 s on an idle machine
