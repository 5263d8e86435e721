"""An evaluation that was interrupted goes on where it stopped."""

import numpy as np
import pytest

from forestrl.evaluation.episodes import evaluate
from forestrl.evaluation.parts import Parts
from tests.evaluation.policies import forest, random_action
from tests.evaluation.test_episodes import assert_same

SETTINGS = {"policy": "random", "env": {"size": 16}}
RUN = {"seed": 0, "indices": range(10), "steps": 6, "batch": 4}


class StoppedError(Exception):
    pass


def stop_after(steps):
    def progress(done):
        if done >= steps:
            raise StoppedError

    return progress


def test_an_interrupted_evaluation_goes_on(tmp_path):
    calls = []

    def policy(td):
        calls.append(td.batch_size[0])
        return random_action(td)

    with pytest.raises(StoppedError):
        evaluate(
            forest, policy, **RUN, parts=Parts(tmp_path, SETTINGS), progress=stop_after(6 * 8 - 3)
        )
    assert len(calls) == 12  # the second chunk was not finished
    calls.clear()
    whole = evaluate(forest, policy, **RUN, parts=Parts(tmp_path, SETTINGS))
    assert calls == [4] * 6 + [2] * 6  # the first chunk was not run again
    assert_same(whole, evaluate(forest, random_action, **RUN))


def test_parts_of_other_settings_are_refused(tmp_path):
    Parts(tmp_path, SETTINGS)
    with pytest.raises(ValueError, match="with policy=random, not learned"):
        Parts(tmp_path, SETTINGS | {"policy": "learned"})


def test_a_damaged_part_is_run_again(tmp_path):
    parts = Parts(tmp_path, SETTINGS)
    first = evaluate(forest, random_action, **RUN, parts=parts)
    (tmp_path / "0-3.npz").write_bytes(b"half")
    assert parts.load(range(4)) is None
    assert_same(first, evaluate(forest, random_action, **RUN, parts=parts))


def test_parts_are_cleared_when_the_whole_is_written(tmp_path):
    parts = Parts(tmp_path / "parts", SETTINGS)
    parts.save(evaluate(forest, random_action, **RUN))
    assert np.load(tmp_path / "parts/0-9.npz")["index"].tolist() == list(range(10))
    parts.clear()
    assert not (tmp_path / "parts").exists()
