"""The report: numbers by hand, tables that can be read back, pictures that open."""

import csv
import json

import numpy as np
import pytest
from PIL import Image

from forestrl.evaluation.reading import read_evaluation
from forestrl.evaluation.report import summarize, table, write_report
from forestrl.paper import COVERAGE, coverage_of
from tests.evaluation.test_episodes import written

FILES = {"coverage.png", "curve.csv", "episodes.csv", "interventions.png", "summary.json"}


def two_arenas(steps=300):
    """One arena covered at once, one to a half; interventions in 10 % and 20 % of the steps."""
    coverage = np.full((2, steps + 1), 0.5)
    coverage[0, 10:] = 1.0
    intervened = np.zeros((2, steps), dtype=bool)
    intervened[0, : steps // 10] = intervened[1, : steps // 5] = True
    counts = {name: np.array([3, 5], dtype=np.int32) for name in ("collisions", "null_actions")}
    path = np.array([10.0, 20.5], dtype=np.float32)
    share = np.array([0.9, 0.4], dtype=np.float32)
    return written(coverage, intervened=intervened, path_length=path, free_share=share, **counts)


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_report_writes_its_files_and_nothing_else(tmp_path):
    folder = tmp_path / "new" / "folder"
    summary = write_report(two_arenas(), folder, title="Two", meta={"policy": "none"})
    assert {path.name for path in folder.iterdir()} == FILES
    assert json.loads((folder / "summary.json").read_text()) == summary
    assert summary["meta"] == {"policy": "none"} and summary["title"] == "Two"


def test_rows_of_the_table_of_episodes(tmp_path):
    write_report(two_arenas(), tmp_path, title="", meta={})
    first, second = read(tmp_path / "episodes.csv")
    assert first == {
        "index": "0",
        "coverage": "1",
        "coverage_250": "1",
        "free_share": "0.9",
        **dict.fromkeys(["steps_to_80", "steps_to_90", "steps_to_95", "steps_to_98"], "10"),
        "intervention_rate": "0.1",
        "null_actions": "3",
        "collisions": "3",
        "path_length": "10",
        "guarded": "0",
        "ending": "covered",
    }
    assert second["steps_to_80"] == "" and second["path_length"] == "20.5"


def test_rows_of_the_curve(tmp_path):
    write_report(two_arenas(), tmp_path, title="", meta={})
    rows = read(tmp_path / "curve.csv")
    assert [int(row["step"]) for row in rows] == list(range(0, 301, 10))
    assert rows[0] == {"step": "0", "mean": "0.5", "low": "0.5", "high": "0.5"}
    assert rows[1]["mean"] == "0.75"


def test_the_curve_keeps_its_last_step(tmp_path):
    write_report(two_arenas(23), tmp_path, title="", meta={})
    assert [row["step"] for row in read(tmp_path / "curve.csv")] == ["0", "10", "20", "23"]


def measures(episodes):
    return {row.pop("measure"): row for row in summarize(episodes)["measures"]}


def test_summary_by_hand():
    summary = measures(two_arenas())
    coverages = {name for name in summary if name.startswith("coverage_")}
    assert coverages == {"coverage_250", "coverage_300"}  # what the budget allows, and its end
    assert summary["coverage_250"] == {"mean": 0.75, "low": 0.5, "high": 1.0, "n": 2}
    assert summary["steps_to_98"] == {"mean": 10, "low": None, "high": None, "n": 1}
    assert summary["reached_98"]["mean"] == 0.5 and summary["reached_98"]["n"] == 2
    assert summary["intervention_rate"]["mean"] == pytest.approx(0.15)
    assert summary["percentile_80"]["mean"] == pytest.approx(0.18)  # 0.1 + 0.8 * 0.1
    assert summary["share_under_15"]["mean"] == 0.5
    assert summary["collisions"]["mean"] == 8 and summary["null_actions"]["mean"] == 4
    assert summary["ended_covered"]["mean"] == 1.0  # as written by hand
    assert not any(name.startswith("area_") for name in summary)


def test_areas_up_to_500_and_2500_steps():
    """Half at first, all from step 10: (9.5 * 0.5 + 490.5) / 500 in the one arena, 0.5 in the
    other."""
    areas = measures(two_arenas(2500))
    assert areas["area_500"]["mean"] == pytest.approx(((9.5 * 0.5 + 490.5) / 500 + 0.5) / 2)
    assert "area_2500" in areas


def test_bootstrap_interval_is_near_the_normal_one_and_repeatable():
    rng = np.random.default_rng(0)
    coverage = rng.uniform(0.2, 0.8, (400, 2))
    interval = measures(written(coverage))["coverage_1"]
    margin = 1.96 * coverage[:, 1].std(ddof=1) / 20
    assert interval["high"] - interval["low"] == pytest.approx(2 * margin, rel=0.1)
    assert interval == measures(written(coverage))["coverage_1"]


def test_one_arena_that_gets_nowhere_is_reported_too(tmp_path):
    summary = write_report(written([[0.1] * 6]), tmp_path, title="One", meta={})
    rows = {row["measure"]: row for row in summary["measures"]}
    assert rows["coverage_5"]["mean"] == pytest.approx(0.1) and rows["coverage_5"]["low"] is None
    assert rows["steps_to_80"]["mean"] is None and rows["reached_80"]["mean"] == 0
    assert read(tmp_path / "curve.csv")[0] == {"step": "0", "mean": "0.1", "low": "", "high": ""}
    assert "in 0.0 % of runs" in table(summary)

    def no_constant(name):
        raise AssertionError(f"{name} is not JSON")

    json.loads((tmp_path / "summary.json").read_text(), parse_constant=no_constant)


def test_what_was_written_is_read_back(tmp_path):
    write_report(two_arenas(), tmp_path, title="", meta={"policy": "none"})
    evaluation = read_evaluation(tmp_path)
    assert (evaluation.arenas, evaluation.steps) == (2, 300)
    assert evaluation.measure("coverage_end") == evaluation.measure("coverage_300")
    assert evaluation.measure("coverage_30").mean == 0.75  # off the curve
    assert evaluation.measure("coverage_31") is None and evaluation.measure("area_500") is None
    assert evaluation.measure("stuck").mean == 0
    assert evaluation.episodes["coverage"].tolist() == [1.0, 0.5]


def test_without_a_filter_nothing_is_said_of_interventions(tmp_path):
    summary = write_report(two_arenas(), tmp_path, title="", meta={"filter": False})
    assert not (tmp_path / "interventions.png").exists()
    assert "interventions" not in table(summary) and "collisions" in table(summary)


@pytest.mark.parametrize("paper", [None, COVERAGE, {2500: 0.88}])
@pytest.mark.parametrize("rate", [0.0, 0.1, 1.0])
def test_pictures_open_with_their_size(tmp_path, paper, rate):
    steps = 2500
    coverage = np.tile(1 - np.exp(-np.arange(steps + 1) / 600), (3, 1))
    intervened = np.zeros((3, steps), dtype=bool)
    intervened[:, : int(rate * steps)] = True
    episodes = written(coverage, intervened=intervened)
    write_report(episodes, tmp_path, title="Three × three", meta={}, paper=paper)
    for name in ("coverage.png", "interventions.png"):
        with Image.open(tmp_path / name) as picture:
            assert picture.size == (960, 600)
            assert len(picture.convert("RGB").getcolors(10**6)) > 20  # something is drawn


def test_table_is_plain_and_narrow():
    text = table({"title": "Two arenas"} | summarize(two_arenas()))
    lines = text.splitlines()
    assert lines[0] == "Two arenas" and max(map(len, lines)) <= 80
    assert "coverage at 250 steps           75.0 %  [50.0, 100.0]" in lines
    assert "collisions                         8" in lines
    assert "nan" not in text and "None" not in text


@pytest.mark.parametrize(
    ("policy", "variant", "size", "expected"),
    [
        ("learned", None, 50, COVERAGE),
        ("learned", None, 75, {}),
        ("cost", "published", 50, {2500: 0.88}),
        ("cost", "corrected", 50, {}),
        ("mmpf", "published", 50, {2500: 0.78}),
        ("nearest_frontier", None, 50, {}),
    ],
)
def test_a_policy_has_its_own_numbers_of_the_paper_only(policy, variant, size, expected):
    assert coverage_of(policy, variant, {"size": size, "n_trees": 45}) == expected
