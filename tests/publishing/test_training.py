"""Fig. 3a's curve: smoothing and scaling by hand."""

import numpy as np
import pytest

from forestrl.publishing.files import ResultError
from forestrl.publishing.results import Training
from forestrl.publishing.training import returns, smoothed


def training(frames, values):
    return Training("metrics.csv", {"frames": np.array(frames), "rollout/return": np.array(values)})


def test_smoothing_keeps_a_line_and_flattens_a_wave():
    x = np.arange(0.0, 100_001.0, 1000.0)
    assert smoothed(x, 3 * x + 1, x) == pytest.approx(3 * x + 1)
    wave = (-1.0) ** np.arange(len(x))
    assert np.abs(smoothed(x, wave, x)[10:-10]).max() == pytest.approx(1 / 21)  # 21 rows a window


def test_the_mean_over_seeds_spans_zero_to_one():
    x = np.arange(1000.0, 50_001.0, 1000.0)
    curve = returns([training(x, x), training(x, x + 2000)])
    assert curve.mean[0] == 0 and curve.mean[-1] == 1
    assert (curve.high - curve.low) * 49_000 == pytest.approx(np.full(200, 2000.0))


def test_updates_without_a_finished_episode_are_left_out():
    x = np.array([1000.0, 2000.0, 3000.0])
    assert returns([training(x, [1.0, np.nan, 3.0])]).frames[-1] == 3000
    with pytest.raises(ResultError, match="fewer than two rows"):
        returns([training(x, [1.0, np.nan, np.nan])])
