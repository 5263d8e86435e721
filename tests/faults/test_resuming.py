"""A run that goes on with other settings: each is done and kept, or refused by name."""

import pytest
from omegaconf import OmegaConf

from tests.commands import SHORT, forestrl, rows, train

EVALUATION = ("eval", "env=tiny", "policy=random", "eval.arenas=2", "eval.steps=5")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return train(tmp_path_factory.mktemp("run"), *SHORT)


@pytest.mark.parametrize(
    ("word", "why"),
    [
        ("seed=1", "seed=1 is not allowed: resume="),
        ("ablation=no_entropy", "ablation=no_entropy is not allowed: resume="),
        ("experiment=paper", "it stands for several settings"),
        ("algo=weight_search", "another method begins anew"),
    ],
)
def test_what_cannot_change_on_the_way_is_refused_by_name(word, why, run):
    before = (run / ".hydra/config.yaml").read_text()
    result = forestrl("train", f"resume={run}", word)
    assert result.status == 1 and why in result.err and len(result.err.splitlines()) == 1
    assert (run / ".hydra/config.yaml").read_text() == before


def test_what_was_asked_for_before_may_be_said_again(run):
    words = ("experiment=smoke", "seed=0", *SHORT)
    result = forestrl("train", f"resume={run}", *words)
    assert result.status == 0 and "there is nothing left to do" in result.out


def test_what_changes_on_the_way_is_kept_for_the_next_time(tmp_path):
    run = train(tmp_path, *SHORT)
    result = forestrl(
        "train", f"resume={run}", "total_frames=512", "algo.lr=1e-4", "reward=coverage"
    )
    assert result.status == 0, result.err
    kept = OmegaConf.load(run / ".hydra/config.yaml")
    assert (kept.total_frames, kept.algo.lr) == (512, 1e-4)
    assert kept.reward._target_.endswith("CoverageReward") or "coverage" in str(kept.reward).lower()
    words = list(OmegaConf.load(run / ".hydra/overrides.yaml"))
    assert "total_frames=512" in words and "total_frames=256" not in words
    result = forestrl("train", f"resume={run}")
    assert "there is nothing left to do" in result.out
    assert [row["frames"] for row in rows(run / "metrics.csv")] == ["256", "512"]


def test_an_evaluation_remembers_its_settings(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr("forestrl.jobs.eval.write_report", lambda *a, **k: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            forestrl(*EVALUATION, "hydra.run.dir=run")
    assert list((tmp_path / "run/parts").glob("*.npz"))
    result = forestrl("eval", "resume=run", "eval.steps=6")
    assert result.status == 1 and "eval.steps=6 is not allowed: resume=" in result.err
    result = forestrl("eval", "resume=run")
    assert result.status == 0, result.err
    assert len(rows(tmp_path / "run/episodes.csv")) == 2
    summary = (tmp_path / "run/summary.json").read_text()
    assert "eval.arenas=2" in summary and "resume=" not in summary
    result = forestrl("eval", "resume=run")
    assert result.status == 0 and "there is nothing left to do" in result.out


def test_a_sweep_names_every_job_that_failed_with_its_log(tmp_path):
    sweep = ("-m", "env.size=2,14,1", f"hydra.sweep.dir={tmp_path}", *SHORT)
    result = forestrl("train", "experiment=smoke", *sweep)
    assert result.status == 1
    first, second = [line for line in result.err.splitlines() if " failed: " in line]
    assert first.startswith(f"forestrl train: {tmp_path}/0/train.log: job 0 (experiment=smoke ")
    assert "env.size=2 is not allowed" in first and "env.size=1 is not allowed" in second
    assert "env.size=1 is not allowed" in (tmp_path / "2/train.log").read_text()
    result = forestrl("train", "experiment=smoke", *sweep)  # does again what failed, alone
    assert result.status == 1 and "1: finished, there is nothing left to do" in result.out


def test_a_sweep_over_nothing_is_an_error(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = forestrl("train", "experiment=smoke", "-m", "seed=range(0,0)")
    assert result.status == 1 and "the sweep is empty" in result.err
    assert list(tmp_path.iterdir()) == []
