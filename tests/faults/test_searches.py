"""A search that is stopped goes on as if it had not been."""

import signal
import threading

from forestrl.explorer.training.task import Task
from tests.commands import forestrl, rows

WORDS = (
    *("experiment=linear", "env=tiny", "eval.arenas=2", "algo.generations=3"),
    *("algo.population=4", "algo.arenas=2", "algo.validate_every=1"),
)


def test_a_search_that_is_stopped_goes_on_with_each_row_once(tmp_path, monkeypatch):
    assert forestrl("train", *WORDS, f"hydra.run.dir={tmp_path}/whole").status == 0
    draw = Task.draw

    def stopped(self, number, *which):
        if which == (3,):
            signal.pthread_kill(threading.main_thread().ident, signal.SIGTERM)
        return draw(self, number, *which)

    run = tmp_path / "run"
    with monkeypatch.context() as patch:
        patch.setattr(Task, "draw", stopped)
        result = forestrl("train", *WORDS, f"hydra.run.dir={run}")
    assert result.status == 143 and f"to go on: forestrl train resume={run}" in result.err
    assert [row["frames"] for row in rows(run / "metrics.csv")] == ["1", "2"]
    result = forestrl("train", f"resume={run}", "experiment=linear", "algo.population=5")
    assert result.status == 1 and "algo.population=5 is not allowed: resume=" in result.err
    assert forestrl("train", f"resume={run}").status == 0
    assert rows(run / "metrics.csv") == rows(tmp_path / "whole/metrics.csv")
    policies = [each / "checkpoints/best/policy.safetensors" for each in (run, tmp_path / "whole")]
    assert policies[0].read_bytes() == policies[1].read_bytes()
    assert "there is nothing left to do" in forestrl("train", f"resume={run}").out
