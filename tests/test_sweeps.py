"""Sweeps written by hand, summed up."""

import csv
import io

import pytest

from forestrl.evaluation.reading import ResultError
from forestrl.sweeps import aggregate
from tests.publishing.folders import write_evaluation, write_job, write_training


def training(folder, *overrides, coverage):
    write_training(folder / "metrics.csv", evaluated=(0.1, coverage) if coverage else ())
    write_job(folder, *overrides)


def evaluation(folder, *overrides, name):
    write_evaluation(folder.parent, "nominal", name).rename(folder)
    write_job(folder, *overrides)


def read(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_trainings_are_grouped_without_their_seed(tmp_path):
    for i, (beta, seed, coverage) in enumerate([(0.25, 0, 0.8), (0.25, 1, 0.9), (0.5, 0, 0.7)]):
        settings = ("experiment=beta", f"reward.beta={beta}", f"seed={seed}")
        training(tmp_path / str(i), *settings, coverage=coverage)
    sweep = aggregate(tmp_path)
    first, second = read(sweep.csv)
    assert first["override"] == "reward.beta=0.25" and first["over"] == "2 seeds"
    numbers = [float(first[f"eval/coverage{part}"]) for part in ("", "_low", "_high")]
    assert numbers == pytest.approx([0.85, 0.8, 0.9])
    assert second["eval/coverage"] == "0.7" and second["eval/coverage_low"] == ""
    (line,) = (line for line in sweep.markdown.splitlines() if "=0.25`" in line)
    cells = [cell.strip() for cell in line.split("|")][1:6]
    assert cells == ["`reward.beta=0.25`", "2 seeds", "3000", "85.0 ± 5.0", "85.0 ± 5.0"]
    assert "All jobs: `experiment=beta`." in sweep.markdown and sweep.skipped == []


def test_evaluations_keep_their_interval_over_arenas(tmp_path):
    for i, name in enumerate(("random", "nearest_frontier")):
        evaluation(tmp_path / str(i), f"policy={name}", name=name)
    first, second = read(aggregate(tmp_path).csv)
    assert first["override"] == "policy=random" and second["over"] == "2 arenas"
    ends = [float(first[f"coverage_end{part}"]) for part in ("", "_low", "_high")]
    assert ends == pytest.approx([0.85, 0.84, 0.86])


def test_jobs_are_in_their_order_two_before_ten(tmp_path):
    for job in ("10", "2"):
        training(tmp_path / job, f"reward.beta={job}", coverage=0.5)
    assert [row["override"] for row in read(aggregate(tmp_path).csv)] == [
        "reward.beta=2",
        "reward.beta=10",
    ]


def test_one_job_without_overrides(tmp_path):
    training(tmp_path / "0", coverage=0.5)
    assert "`as configured`" in aggregate(tmp_path).markdown


def test_jobs_without_a_result_are_named(tmp_path):
    training(tmp_path / "0", "seed=0", coverage=0.5)
    write_job(tmp_path / "1", "seed=1")
    training(tmp_path / "2", "seed=2", coverage=None)
    missing, early = aggregate(tmp_path).skipped
    assert "1 has neither summary.json nor metrics.csv" in missing
    assert "has no evaluation" in early


def test_nothing_to_sum_up_is_refused(tmp_path):
    with pytest.raises(ResultError, match="holds no job: it wants"):
        aggregate(tmp_path)
    write_job(tmp_path / "0")
    with pytest.raises(ResultError, match="neither"):
        aggregate(tmp_path)


def test_trainings_and_evaluations_do_not_mix(tmp_path):
    training(tmp_path / "0", coverage=0.5)
    evaluation(tmp_path / "1", name="random")
    with pytest.raises(ResultError, match="mixes"):
        aggregate(tmp_path)


def test_a_broken_summary_is_named(tmp_path):
    evaluation(tmp_path / "0", name="random")
    path = tmp_path / "0/summary.json"
    path.write_text(path.read_text().replace('"mean"', '"means"'))
    with pytest.raises(ResultError, match="lacks mean in its measures"):
        aggregate(tmp_path)
