"""When an episode falls behind another."""

from hypothesis import given
from hypothesis import strategies as st

from forestrl.pages.comparing import falls_behind


def curve_of(gains):
    level, curve = 0, [0]
    for gain in gains:
        curve.append(level := level + gain)
    return [each / 100 for each in curve]


CURVES = st.lists(st.integers(0, 5), min_size=1, max_size=30).map(curve_of)


def naively(curves, goal):
    """Steps back from each one's end for as long as another is ahead."""

    def level(curve, step):
        return min(curve[min(step, len(curve) - 1)], goal)

    last = max(map(len, curves)) - 1
    for curve in curves:
        end = next((step for step in range(last + 1) if level(curve, step) >= goal), last + 1)
        step = end
        while step > 0 and level(curve, step - 1) < max(level(each, step - 1) for each in curves):
            step -= 1
        yield None if step == end else step


def test_one_that_leads_and_then_stays_back_falls_behind_where_it_is_overtaken():
    curves = [[0.1, 0.2, 0.5, 0.6], [0.1, 0.3, 0.4, 0.5]]
    assert falls_behind(curves, goal=0.98) == [None, 2]


def test_one_that_ended_short_of_the_goal_is_overtaken_afterwards():
    assert falls_behind([[0.1, 0.5], [0.1, 0.2, 0.3, 0.6]], goal=0.98) == [3, None]


def test_an_episode_alone_and_equal_episodes_fall_behind_nobody():
    assert falls_behind([[0.1, 0.2]], goal=0.9) == [None]
    assert falls_behind([[0.1, 0.2], [0.1, 0.2]], goal=0.9) == [None, None]


def test_what_is_covered_past_the_goal_does_not_count():
    assert falls_behind([[0.1, 0.92], [0.1, 0.99]], goal=0.9) == [None, None]


@given(st.lists(CURVES, min_size=1, max_size=4))
def test_falling_behind_agrees_with_stepping_back_from_the_end(curves):
    assert falls_behind(curves, goal=0.6) == list(naively(curves, 0.6))
