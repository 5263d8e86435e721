"""The page of metrics explains what a training logs, and nothing else."""

from __future__ import annotations

import csv

from tests.commands import train
from tests.docs.pages import explained_metrics


def test_every_metric_of_a_training_is_explained_and_no_other(tmp_path):
    run = train(tmp_path)
    with (run / "metrics.csv").open(newline="") as file:
        logged = next(csv.reader(file))
    assert explained_metrics() - {"reward/mean"} == set(logged)
    assert "reward/mean" in explained_metrics()  # of other rewards; tests/learning/test_metrics.py
