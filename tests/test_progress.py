"""The lines a training prints where there is no terminal."""

from forestrl.progress import Progress

METRICS = {
    "rollout/return": 12.0,
    "rollout/coverage": float("nan"),
    "safety/intervention_rate": 0.25,
}


def test_the_last_update_prints_a_line_with_no_time_left(capsys):
    with Progress(200) as bar:
        bar.update(100, METRICS)
        assert capsys.readouterr().err == ""  # lines are seconds apart
        bar.update(200, METRICS | {"rollout/coverage": 0.5})
    (line,) = capsys.readouterr().err.splitlines()
    assert line.split()[:4] == ["200", "of", "200", "frames"] and "0:00 left" in line
    assert "return 12" in line and "coverage 0.5" in line and "interventions 0.25" in line


def test_a_metric_that_is_nan_keeps_its_last_value(capsys):
    with Progress(100) as bar:
        bar.update(50, METRICS | {"rollout/coverage": 0.5})
        bar.update(100, METRICS)
    assert "coverage 0.5" in capsys.readouterr().err
    assert "50.0% in training episodes, cut short at first" in bar.summary({})
    coverage = bar.summary({"eval/coverage": 0.75}).splitlines()[-1]
    assert coverage.split(maxsplit=1) == ["coverage", "75.0% in test arenas"]
