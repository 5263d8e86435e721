"""Sweeps written by hand, summed up."""

import csv
import io
import json

import pytest

from forestrl.publishing.files import ResultError
from forestrl.publishing.sweeps import Job, aggregate
from tests.publishing.folders import write_evaluation, write_training


def training(folder, *overrides, coverage):
    write_training(folder / "metrics.csv", evaluated=(0.1, coverage) if coverage else ())
    return Job(folder, list(overrides))


def read(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_trainings_are_grouped_without_their_seed(tmp_path):
    jobs = [
        training(tmp_path / str(i), "experiment=beta", f"reward.beta={beta}", f"seed={seed}",
                 coverage=coverage)
        for i, (beta, seed, coverage) in enumerate(
            [(0.25, 0, 0.8), (0.25, 1, 0.9), (0.5, 0, 0.7)])
    ]  # fmt: skip
    sweep = aggregate(jobs)
    first, second = read(sweep.csv)
    assert first["override"] == "reward.beta=0.25" and first["over"] == "2 seeds"
    numbers = [float(first[f"eval/coverage{part}"]) for part in ("", "_low", "_high")]
    assert numbers == pytest.approx([0.85, 0.8, 0.9])
    assert second["eval/coverage"] == "0.7" and second["eval/coverage_low"] == ""
    assert "| `reward.beta=0.25` | 2 seeds | 3000 | 85.0 ± 5.0 | 85.0 ± 5.0 |" in sweep.markdown
    assert "All jobs: `experiment=beta`." in sweep.markdown and sweep.skipped == []


def test_evaluations_keep_their_interval_over_arenas(tmp_path):
    names = ("random", "nearest_frontier")
    jobs = [Job(write_evaluation(tmp_path, name=name), [f"policy={name}"]) for name in names]
    first, second = read(aggregate(jobs).csv)
    assert first["override"] == "policy=random" and second["over"] == "2 arenas"
    assert [first[f"coverage_end{part}"] for part in ("", "_low", "_high")] == [
        "0.85",
        "0.84",
        "0.86",
    ]


def test_one_job_without_overrides(tmp_path):
    assert "`as configured`" in aggregate([training(tmp_path, coverage=0.5)]).markdown


def test_jobs_without_a_result_are_named(tmp_path):
    jobs = [training(tmp_path / "0", "seed=0", coverage=0.5), Job(tmp_path / "1", ["seed=1"])]
    jobs.append(training(tmp_path / "2", "seed=2", coverage=None))
    missing, early = aggregate(jobs).skipped
    assert "1 has neither summary.json nor metrics.csv" in missing
    assert "has no evaluation" in early


def test_nothing_to_sum_up_is_refused(tmp_path):
    with pytest.raises(ResultError, match="neither"):
        aggregate([Job(tmp_path, [])])


def test_trainings_and_evaluations_do_not_mix(tmp_path):
    jobs = [training(tmp_path / "0", coverage=0.5), Job(write_evaluation(tmp_path), [])]
    with pytest.raises(ResultError, match="mixes"):
        aggregate(jobs)


def test_a_broken_summary_is_named(tmp_path):
    folder = write_evaluation(tmp_path)
    summary = json.loads((folder / "summary.json").read_text())
    del summary["interventions"]["rate"]
    (folder / "summary.json").write_text(json.dumps(summary))
    with pytest.raises(ResultError, match=r"lacks interventions\.rate"):
        aggregate([Job(folder, [])])
