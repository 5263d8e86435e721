"""Several policies in one picture: each its own view, name, colour and curve."""

import numpy as np
import pytest

from forestrl.evaluation import arenas, uniforms
from forestrl.planners import CostBased, InformationGain, NearestFrontier
from forestrl.rendering import draw_side_by_side, in_step, play
from forestrl.rendering import panel as P
from forestrl.rendering.curves import draw_curves, tick_spacing
from tests.evaluation.policies import forest, random_action
from tests.rendering.scenes import count, places, word

SHAPES = [3, 8, 50, 100, (20, 60), (60, 20), (3, 300), (300, 3)]
POLICIES = {"nearest": NearestFrontier(), "gain": InformationGain(), "any": random_action}


def episodes(policies, *, steps=60, every=5, **options):
    env = forest(1, **{"size": 16} | options)
    td, draws = arenas.draw_arenas(env, 0, [0]), uniforms(0, [0], steps)
    return {
        name: play(env, policy, td, steps=steps, every=every, uniforms=draws)
        for name, policy in policies.items()
    }


def test_episodes_go_in_step_and_wait_for_the_last():
    alone = {name: [*each] for name, each in episodes(POLICIES, steps=200).items()}
    together = list(in_step(episodes(POLICIES, steps=200)))
    lengths = {name: len(each) for name, each in alone.items()}
    assert len(together) == max(lengths.values()) > min(lengths.values())
    for i, scenes in enumerate(together):
        for name, each in scenes.items():
            assert each.way == alone[name][min(i, lengths[name] - 1)].way


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@pytest.mark.parametrize("policies", [2, 3])
def test_pictures_have_one_size_and_all_names_in_their_colours(shape, policies):
    chosen = dict([*POLICIES.items()][:policies])
    played = episodes(chosen, steps=4, every=1, size=shape, n_trees=2, tree_radius=(0.5, 1.0))
    pictures = [draw_side_by_side(scenes, 4) for scenes in in_step(played)]
    assert len({picture.size for picture in pictures}) == 1 and pictures[0].width <= 1300
    colours = (P.AGENT, P.FEASIBLE, P.INTERVENTION)
    for picture in pictures:
        found = [places(word(n, colour=c), picture) for n, c in zip(chosen, colours, strict=False)]
        assert [len(each) for each in found] == [1] * policies


def test_each_view_says_what_happened_in_it():
    policies = {"nearest": NearestFrontier(), "stuck": CostBased(), "any": random_action}
    *_, last = in_step(episodes(policies, steps=120, size=20))
    picture = draw_side_by_side(last, 120)
    nearest, stuck, lost = last.values()
    assert places(word(f"98 % at step {nearest.step}"), picture)
    assert len(lost.interventions) > 0
    assert places(word(f"interventions {len(lost.interventions)}"), picture)
    assert places(word(f"coverage {100 * stuck.coverage:.1f} %", colour=P.FEASIBLE), picture)


def test_a_scale_and_any_number_of_policies_are_possible():
    many = {f"{name} {i}": policy for i in range(2) for name, policy in POLICIES.items()}
    scenes = next(in_step(episodes(many, steps=1)))
    small, large = (draw_side_by_side(scenes, 1, scale) for scale in (4, 9))
    assert small.height < large.height
    assert all(places(word("gain 1", colour=P.AGENT), picture) for picture in (small, large))


def height_of(picture, colour, x):
    """The middle of a colour in a column, from the upper edge."""
    return np.argwhere((np.asarray(picture)[:, x] == colour).all(-1)).mean()


def test_curves_end_at_the_present_step_and_are_as_high_as_the_coverage():
    """Between 46 pixels on the left and 18 on the right lie 200 steps: one every pixel."""
    full, half = [1.0] * 101, [0.5] * 51
    picture = draw_curves([full, half], [P.AGENT, P.FEASIBLE], steps=200, goal=0.98, width=264)
    top, middle, bottom = 8, 46, 84
    assert height_of(picture, P.AGENT, 46 + 80) == pytest.approx(top, abs=1)
    assert height_of(picture, P.FEASIBLE, 46 + 30) == pytest.approx(middle, abs=1)
    for colour, last in ((P.AGENT, 100), (P.FEASIBLE, 50)):
        _, columns = (np.asarray(picture) == colour).all(-1).nonzero()
        assert columns.max() == pytest.approx(46 + last + 4, abs=1)  # the dot's radius is 4
    cursor = np.asarray(picture)[top + 8 : bottom - 4, 46 + 100]
    assert (cursor == P.FAINT).all(-1).mean() > 0.9
    assert count(picture, P.AGENT) > count(picture, P.FEASIBLE)


@pytest.mark.parametrize("steps", [1, 2, 7, 30, 300, 499, 500, 501, 2500, 10_000])
def test_the_axis_has_a_few_round_numbers(steps):
    spacing = tick_spacing(steps)
    assert f"{spacing}".rstrip("0") in ("1", "2", "5")
    assert steps / spacing <= 6 and (spacing == 1 or steps / spacing > 2)


def test_the_axis_has_its_numbers_below():
    picture = draw_curves([[0.0]], [P.AGENT], steps=3, goal=0.98, width=46 + 300 + 18)
    below = np.asarray(picture)[87:]
    columns = [i for i in range(40, picture.width) if (below[:, i] < 200).any()]
    assert {round((i - 46) / 100) for i in columns} == {0, 1, 2, 3}
    assert all(abs(i - 46 - 100 * round((i - 46) / 100)) < 8 for i in columns)
