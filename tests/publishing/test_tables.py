"""The tables' text by hand."""

import pytest

from forestrl.evaluation.reading import last_step_ahead
from forestrl.publishing.results import read_results
from forestrl.publishing.statements import findings, reproduction, summary, verdict
from forestrl.publishing.tables import differences, endings, forests, headline, learning, short
from forestrl.statistics import Interval
from forestrl.tables import Column, markdown
from tests.publishing.folders import write_evaluation, write_training


def cells(table, label):
    """The cells of the one row that begins with a label, by the head of their column."""
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    (row,) = (line for line in lines if line[0] == label)
    return dict(zip(lines[0], row, strict=True))


def test_markdown():
    table = markdown(["a", "b"], [["x", "1"], ["y", "2"]])
    assert cells(table, "x") == {"a": "x", "b": "1"} and cells(table, "y")["b"] == "2"
    assert table.splitlines()[1].replace("-", "") == "|:|:|"  # the first to the left


@pytest.mark.parametrize(
    ("interval", "text"),
    [
        (None, "–"),
        (Interval(0.5), "50.0"),
        (Interval(0.971, 0.969, 0.972), "97.1 ± 0.2"),
        (Interval(0.0), "0"),
        (Interval(0.0, 0.0, 0.0), "0"),
    ],
)
def test_cells(interval, text):
    assert Column("", "").cell(interval) == text


def test_headline_sets_the_paper_beside_ours_and_marks_the_best(tmp_path):
    write_evaluation(tmp_path, coverage=(0.9, 0.8))
    write_evaluation(tmp_path, name="nearest_frontier", coverage=(1.0, 0.98), rate=0)
    write_evaluation(tmp_path, name="hindsight", coverage=(1.0, 1.0), rate=0)
    write_evaluation(tmp_path, name="my_planner", coverage=(0.5, 0.5), rate=0.2)
    table = headline(read_results(tmp_path))
    ours, theirs = cells(table, "GATv2 and PPO"), cells(table, "*paper: GATv2 and PPO*")
    assert ours["± over"] == "2 arenas" and ours["coverage at 2500"] == "85.0 ± 1.0"
    assert theirs["coverage at 2500"] == "97"
    assert theirs["coverage at 250"] == "–" and theirs["their 80th percentile"] == "15"
    best = cells(table, "nearest frontier")
    assert best["coverage at 2500"] == "**99.0 ± 1.0**"
    assert best["interventions"] == "0"
    assert ours["interventions"] == "**10.0 ± 1.0**"
    assert ours["steps to 98 %"] == "**400 ± 10** (100 %)"
    assert "**" not in "".join(cells(table, "hindsight (sees the whole forest)").values())
    assert table.splitlines()[-1].startswith("| `my_planner`")


def test_the_short_table_has_the_policies_that_the_catalogue_names(tmp_path):
    for name in ("paper", "paper_mode", "nearest_frontier", "random"):
        write_evaluation(tmp_path, name=name)
    table = short(read_results(tmp_path))
    assert [line.split("|")[1].strip() for line in table.splitlines()[2:]] == [
        "GATv2 and PPO",
        "nearest frontier",
    ]


def test_a_method_of_several_seeds_has_a_row_over_seeds_and_one_of_its_checkpoint(tmp_path):
    for seed, share in enumerate((0.8, 0.9)):
        name = f"paper_seed{seed}" if seed else "paper"
        write_evaluation(tmp_path, name=name, coverage=(share, share))
    table = headline(read_results(tmp_path))
    method, checkpoint = cells(table, "GATv2 and PPO"), cells(table, "GATv2 and PPO: seed 0")
    assert method["± over"] == "2 seeds" and method["coverage at 500"].strip("*") == "85.0 ± 5.0"
    assert checkpoint["± over"] == "2 arenas" and checkpoint["coverage at 500"] == "80.0 ± 1.0"


@pytest.mark.parametrize(
    ("value", "share", "kind", "text"),
    [
        (Interval(0.81, 0.80, 0.82), 0.80, "≥", "yes"),
        (Interval(0.79, 0.77, 0.81), 0.80, "≥", "within the interval"),
        (Interval(0.75, 0.74, 0.76), 0.80, "≥", "no: −5.0"),
        (Interval(0.05, 0.04, 0.06), 0.10, "≤", "yes"),
        (Interval(0.12, 0.11, 0.13), 0.10, "≤", "no: +2.0"),
        (Interval(0.90, 0.89, 0.91), 0.88, "=", "no: +2.0"),
        (Interval(0.88), 0.90, "≥", "no: −2.0"),
        (Interval(0.88), 0.88, "=", "within the interval"),
    ],
)
def test_verdicts(value, share, kind, text):
    assert verdict(value, share, kind) == text


def test_reproduction_lists_what_was_measured_only(tmp_path):
    write_evaluation(tmp_path, coverage=(0.9, 0.8))
    write_evaluation(tmp_path, "trees75", coverage=(0.9, 0.9), rate=0.3)
    table = reproduction(read_results(tmp_path), "paper")
    assert cells(table, "GATv2 and PPO: coverage at 1000 steps") == {
        "statement of the paper (%)": "GATv2 and PPO: coverage at 1000 steps",
        "paper": "≥ 80",
        "here": "85.0 ± 1.0",
        "± over": "2 arenas",
        "holds": "yes",
    }
    assert cells(table, "75 trunks: interventions, mean")["holds"] == "no: +10.0"
    assert "h = 75" not in table and "MMPF" not in table


def test_paired_differences_are_marked_by_who_is_ahead(tmp_path):
    write_evaluation(tmp_path, coverage=(0.9, 0.7), rate=0.1)
    write_evaluation(tmp_path, name="random", coverage=(0.5, 0.3), rate=0.0)
    row = cells(differences(read_results(tmp_path), "paper"), "random walk")
    assert row["arenas"] == "2" and row["coverage at the end"] == "**+40.0 ± 0.0**"
    assert row["interventions"] == "*+10.0 ± 0.0*"
    assert row["area to 500"] == "–"  # no such column in episodes.csv
    assert row["steps to 98 %"] == "0 (2)"


def test_policies_in_other_arenas_are_not_paired(tmp_path):
    write_evaluation(tmp_path)
    other = write_evaluation(tmp_path, name="random") / "summary.json"
    other.write_text(other.read_text().replace('"seed": 0', '"seed": 1'))
    assert differences(read_results(tmp_path), "paper") == ""


def test_other_forests(tmp_path):
    write_evaluation(tmp_path)
    ends = {"covered": 0.5, "cycle": 0.25, "at_goal": 0.25}
    write_evaluation(tmp_path, "size75", coverage=(0.6, 0.6), endings=ends)
    table = forests(read_results(tmp_path))
    assert len(table.splitlines()) == 3
    row = cells(table, "h = 75, 101 trunks")
    assert row["coverage at the end"] == "60.0 ± 1.0" and row["coverage at 5000"] == "–"
    assert (row["steps"], row["reached 98 %"], row["stuck"]) == ("2500", "100.0", "50.0")


def test_endings_say_who_is_stuck_and_why(tmp_path):
    stuck = {"covered": 0.75, "cycle": 0.25}
    write_evaluation(tmp_path, name="cost_published", coverage=(1, 1, 1, 0.05), endings=stuck)
    half = {"covered": 0.5, "budget": 0.5}
    write_evaluation(tmp_path, coverage=(0.99, 0.09), endings=half)
    write_evaluation(tmp_path, name="paper_seed1", coverage=(0.99, 0.99))
    table = endings(read_results(tmp_path))
    assert cells(table, "GATv2 and PPO") == {
        "policy": "GATv2 and PPO",
        "runs": "4",
        "reached 98 %": "75.0",
        "steps used up": "25.0",
        "in a cycle": "0",
        "goal is its own cell": "0",
        "sees no goal in reach": "0",
        "coverage of the others": "9.0",
    }
    planner = cells(table, "cost-based, as published")
    assert (planner["in a cycle"], planner["coverage of the others"]) == ("25.0", "5.0")
    elsewhere = cells(table, "*Explore-Bench's own simulator: cost-based*")
    assert (elsewhere["reached 98 %"], elsewhere["goal is its own cell"]) == ("65.0", "7.5")


def test_the_summary_names_wins_and_losses(tmp_path):
    write_evaluation(tmp_path, coverage=(0.99, 0.97), rate=0.3, endings={})
    write_evaluation(tmp_path, name="random", coverage=(0.5, 0.05), rate=0.0)
    write_evaluation(tmp_path, name="nearest_frontier", coverage=(1.0, 0.98), rate=0.0)
    write_evaluation(tmp_path, name="cost_published", coverage=(0.9, 0.86), rate=0.0)
    write_evaluation(tmp_path, name="mmpf_published", coverage=(0.9, 0.9), rate=0.0)
    write_training(tmp_path / "training" / "seed0.csv", evaluated=(0.9, 0.8))
    lines = summary(read_results(tmp_path), "paper").splitlines()
    reproduced, conditions, beats, beaten, steps = lines
    assert "the paper's 5 numbers about its policy, 4 are reached or passed" in reproduced
    assert "interventions, mean 30.0 ± 1.0 % (paper 10). Its benchmarks" in reproduced
    assert "MMPF, as published: coverage at 2500 steps 90.0 ± 1.0 % (paper 78)" in reproduced
    assert "best of 2 checkpoints" in conditions
    assert "The last checkpoints cover 80.0 % there" in conditions
    assert "on the same 2 arenas" in beats and "random walk +70.5 ± 21.5." in beats
    assert beaten.endswith("in percentage points: nearest frontier −1.0 ± 0.0.")
    assert "GATv2 and PPO 400 ± 10 in 100 % of the runs; cost-based" in steps
    assert "random walk" not in steps  # half of its runs got there


def test_a_benchmark_that_ends_where_the_papers_does_holds(tmp_path):
    write_evaluation(tmp_path, name="cost_published", coverage=(0.88, 0.88))
    write_evaluation(tmp_path, name="mmpf_published", coverage=(0.90, 0.90))
    cost, mmpf = findings(read_results(tmp_path), "paper")
    assert cost.holds and cost.verdict == "within the interval"
    assert not mmpf.holds and mmpf.verdict == "no: +12.0"


@pytest.mark.parametrize(
    ("theirs", "step"),
    [
        ((0.4, 0.5, 0.9), 1166),  # 0.1 ahead at 500, 0.2 behind at 2500: even a third of the way
        ((0.4, 0.6, 0.9), 499),
        ((0.5, 0.6, 0.9), None),
        ((0, 0.9, 0), None),
    ],
)
def test_the_last_step_ahead(tmp_path, theirs, step):
    folders = [write_evaluation(tmp_path, name=name) for name in ("paper", "random")]
    for folder, curve in zip(folders, ((0.5, 0.6, 0.7), theirs), strict=True):
        rows = [f"{at},{x},{x},{x}" for at, x in zip((0, 500, 2500), curve, strict=True)]
        (folder / "curve.csv").write_text("\n".join(["step,mean,low,high", *rows]) + "\n")
    methods = read_results(tmp_path).settings["nominal"]
    assert last_step_ahead(methods["paper"].first, methods["random"].first) == step
    found = f"of random walk to step {step}." in summary(read_results(tmp_path), "paper")
    assert found == (step is not None)


def test_without_the_paper_policy_there_is_no_summary(tmp_path):
    write_evaluation(tmp_path, name="random")
    assert summary(read_results(tmp_path), "paper") == ""


def test_trainings_of_both_networks_are_set_side_by_side(tmp_path):
    def write(group, seed, first, second):
        write_training(tmp_path / group / f"seed{seed}.csv", [first] * 12 + [second] * 14)

    write("training", 0, 10, 50), write("training", 1, 30, 70)
    write("training_pyg", 0, 20, 80), write("training_pyg", 1, 40, 90)
    lines = learning(read_results(tmp_path)).splitlines()
    rows = [[cell.strip() for cell in line.strip("| ").split("|")] for line in lines]
    returns = ["rollout/return", "0 to 12,800", "20 (10 to 30)", "30 (20 to 40)", "yes"]
    assert rows[2] == returns  # updates at 1000, 2000, ... frames
    assert rows[3][1:] == ["12,800 to 25,600", "60 (50 to 70)", "85 (80 to 90)", "no"]
    assert rows[5][2:4] == ["60.0 (50.0 to 70.0)", "85.0 (80.0 to 90.0)"]


def test_without_trainings_of_both_networks_there_is_no_comparison(tmp_path):
    write_training(tmp_path / "training" / "seed0.csv")
    assert learning(read_results(tmp_path)) == ""
