"""Fig. 3a's curve: smoothing and scaling by hand."""

import numpy as np
import pandas as pd
import pytest

from forestrl.evaluation.reading import ResultError
from forestrl.publishing.figures import returns, smoothed
from forestrl.publishing.results import Training


def training(frames, values):
    return Training("metrics.csv", pd.DataFrame({"frames": frames, "rollout/return": values}))


def test_smoothing_keeps_a_line_and_flattens_a_wave():
    x = np.arange(0.0, 100_001.0, 1000.0)
    assert smoothed(x, 3 * x + 1, x) == pytest.approx(3 * x + 1)
    wave = (-1.0) ** np.arange(len(x))
    assert np.abs(smoothed(x, wave, x)[10:-10]).max() == pytest.approx(1 / 21)  # 21 rows a window


def test_the_mean_over_seeds_spans_zero_to_one():
    x = np.arange(1000.0, 50_001.0, 1000.0)
    _, mean, low, high = returns([training(x, x), training(x, x + 2000)])
    assert mean[0] == 0 and mean[-1] == 1
    assert (high - low) * 49_000 == pytest.approx(np.full(200, 2000.0))


def test_updates_without_a_finished_episode_are_left_out():
    x = np.array([1000.0, 2000.0, 3000.0])
    assert returns([training(x, [1.0, np.nan, 3.0])])[0][-1] == 3000
    with pytest.raises(ResultError, match="fewer than two rows"):
        returns([training(x, [1.0, np.nan, np.nan])])
