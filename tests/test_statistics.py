"""Intervals and paired differences by hand."""

import math

import numpy as np
import pytest

from forestrl.statistics import Interval, bootstrap, mean_interval, paired_difference


def test_a_constant_has_an_interval_of_width_zero():
    assert mean_interval([0.5] * 7) == Interval(0.5, 0.5, 0.5)


def test_two_values_give_their_range():
    """A resample is both of one or both of the other in a quarter of the cases each."""
    assert mean_interval([1.0, 3.0]) == Interval(2.0, 1.0, 3.0)


def test_one_value_has_no_interval_and_none_have_no_mean():
    one = mean_interval([4.0])
    assert one.mean == 4.0 and math.isnan(one.low) and math.isnan(one.high)
    assert mean_interval([]) is None and mean_interval([math.nan]) is None


def test_nan_is_left_out():
    assert mean_interval([1.0, math.nan, 3.0]) == mean_interval([1.0, 3.0])


def test_interval_of_many_values_is_near_the_normal_one():
    values = np.random.default_rng(0).normal(size=400)
    interval = mean_interval(values)
    margin = 1.96 * values.std(ddof=1) / 20
    assert interval.high - interval.low == pytest.approx(2 * margin, rel=0.1)


def test_margin_is_the_larger_side():
    assert Interval(5.0, 4.0, 7.0).margin == 2.0
    assert Interval(5.0, 2.0, 7.0).margin == 3.0


def test_bootstrap_of_curves_goes_over_the_first_axis():
    mean, low, high = bootstrap(np.array([[0.0, 5.0], [2.0, 5.0]]))
    assert (
        mean.tolist() == [1.0, 5.0] and low.tolist() == [0.0, 5.0] and high.tolist() == [2.0, 5.0]
    )


def test_constant_differences_have_an_interval_of_width_zero_however_the_arenas_vary():
    first = {arena: float(arena**2) for arena in range(20)}
    second = {arena: value - 3.0 for arena, value in first.items()}
    difference = paired_difference(first, second)
    assert difference.interval == Interval(3.0, 3.0, 3.0)
    assert difference.arenas == 20 and difference.sign == 1
    assert paired_difference(second, first).sign == -1


def test_only_arenas_with_both_numbers_count():
    first = {0: 1.0, 1: 5.0, 2: math.nan, 7: 9.0}
    second = {7: 8.0, 2: 1.0, 1: 4.0, 3: 100.0}
    difference = paired_difference(first, second)
    assert difference.arenas == 2 and difference.interval == Interval(1.0, 1.0, 1.0)


def test_differences_around_zero_have_no_sign():
    assert paired_difference({0: 1.0, 1: -1.0}, {0: 0.0, 1: 0.0}).sign == 0


def test_no_common_arena_is_no_difference():
    assert paired_difference({0: 1.0}, {1: 1.0}) is None
