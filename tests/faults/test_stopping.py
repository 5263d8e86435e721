"""A signal stops a command politely: saved, said in one line, and gone on with."""

import os
import shlex
import signal
import threading

import pytest

from forestrl.learning.metrics import summarize
from forestrl.stopping import Stopped, check, stopping
from tests.commands import SHORT, forestrl, rows, train

SENT = [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
HERE = threading.main_thread().ident


def after_updates(monkeypatch, number, count):
    """Sends this process a signal in the middle of an update."""
    calls = []

    def measured(*arguments):
        calls.append(1)
        if len(calls) == count:
            signal.pthread_kill(HERE, number)
        return summarize(*arguments)

    monkeypatch.setattr("forestrl.jobs.train.summarize", measured)


@pytest.fixture(autouse=True)
def heard():
    """The signals as a terminal has them: a shell in the background would have some ignored."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number, _ in SENT}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return train(tmp_path_factory.mktemp("whole"))


@pytest.mark.parametrize(("number", "status"), SENT)
def test_a_training_that_is_stopped_says_how_to_go_on_and_equals_one_that_was_not(
    number, status, whole, tmp_path, monkeypatch
):
    """Also from a folder whose name means something to the shell."""
    run = tmp_path / "it's a run"
    with monkeypatch.context() as patch:
        after_updates(patch, number, count=2)
        folder = f"hydra.run.dir={run}".replace("'", "\\'")
        folder = folder.replace("=", "='", 1) + "'"
        result = forestrl("train", "experiment=smoke", "checkpoint_every=0", folder)
    assert result.status == status
    said = result.err.splitlines()[-1]
    assert said.startswith(f"forestrl train: stopped by {number.name}, saved; to go on: forestrl ")
    assert "Traceback" not in result.err
    assert [row["frames"] for row in rows(run / "metrics.csv")] == ["256"]
    words = shlex.split(said.partition("to go on: forestrl ")[2])
    assert forestrl(*words).status == 0
    assert rows(run / "metrics.csv") == rows(whole / "metrics.csv")


def test_a_sweep_that_is_stopped_goes_on_with_the_job_that_was_stopped(tmp_path, monkeypatch):
    sweep = ("experiment=smoke", "-m", "seed=0,1", f"hydra.sweep.dir={tmp_path}", *SHORT)
    with monkeypatch.context() as patch:
        after_updates(patch, signal.SIGTERM, count=2)
        result = forestrl("train", *sweep)
    assert result.status == 143
    first = (tmp_path / "0/metrics.csv").stat().st_mtime_ns
    words = shlex.split(result.err.splitlines()[-1].partition("to go on: forestrl ")[2])
    result = forestrl(*words)
    assert result.status == 0, result.err
    assert "0: finished, there is nothing left to do" in result.out
    assert (tmp_path / "0/metrics.csv").stat().st_mtime_ns == first
    assert [row["frames"] for row in rows(tmp_path / "1/metrics.csv")] == ["256"]


def test_a_command_that_cannot_go_on_says_that_it_was_stopped(tmp_path, monkeypatch):
    def play(*arguments, **settings):
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr("forestrl.jobs.render.draw_episode", play)
    result = forestrl("render", "env=tiny", "policy=random", f"hydra.run.dir={tmp_path}/run")
    assert (result.status, result.err) == (143, "forestrl render: stopped by SIGTERM\n")
    assert not (tmp_path / "run").exists()


def test_a_signal_that_arrives_where_errors_are_swallowed_stops_the_program_at_the_next_check():
    with stopping():
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        except BaseException:
            pass
        with pytest.raises(Stopped):
            check()


def test_a_signal_that_is_ignored_stays_ignored():
    """As ``nohup`` has it."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with stopping():
            os.kill(os.getpid(), signal.SIGHUP)
            check()
    finally:
        signal.signal(signal.SIGHUP, before)
