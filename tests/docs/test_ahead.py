"""The page on the explorer: its tables are those of the results."""

import csv
import json
from pathlib import Path

import numpy as np

from forestrl.statistics import mean_interval

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "multirun/results/ahead"
PAGE = (ROOT / "docs/ahead.md").read_text(encoding="utf-8")


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def column(setting, policy, name):
    rows = read(RESULTS / setting / policy / "episodes.csv")
    return np.array([float(row[name] or "nan") for row in rows])


def with_margin(values, digits=1):
    interval = mean_interval(values)
    return f"{interval.mean:.{digits}f} ± {interval.margin:.{digits}f}".replace("-", "−")


def row_of(setting, policy):
    """A row of the page's table; differences are the explorer's, on the same arenas."""
    steps, area = column(setting, policy, "steps_to_98"), column(setting, policy, "area_500")
    ours, our_area = (column(setting, "learned", name) for name in ("steps_to_98", "area_500"))
    reached = np.mean(~np.isnan(steps))
    cells = [setting, f"`{policy}`", str(len(steps)), with_margin(steps), f"{reached:.0%}"]
    cells += [f"{np.nanmax(steps):.0f}", with_margin(100 * area)]
    if policy == "learned":
        return [*cells, "", ""]
    both = (ours - steps)[~np.isnan(ours - steps)]
    return [*cells, with_margin(both), with_margin(100 * (our_area - area))]


def folders():
    return sorted(path.parent for path in RESULTS.glob("*/*/summary.json"))


def test_every_row_is_that_of_its_files():
    assert len(folders()) >= 6
    for folder in folders():
        row = "| " + " | ".join(row_of(folder.parent.name, folder.name)) + " |"
        assert row.replace("|  |", "| |") in PAGE.replace("|  |", "| |"), row


def test_every_evaluation_is_safe_and_its_command_is_on_the_page():
    for folder in folders():
        summary = json.loads((folder / "summary.json").read_text())
        measures = {each["measure"]: each["mean"] for each in summary["measures"]}
        assert measures["collisions"] == 0 and measures["intervention_rate"] < 0.001
        command = summary["meta"]["command"].replace(f"policy={folder.name}", "policy=learned")
        assert command in PAGE, command


def test_the_learning_curves_are_those_of_the_trainings():
    for path in sorted((RESULTS / "training").glob("explorer_seed*.csv")):
        steps = [float(row["eval/steps"]) for row in read(path) if row["eval/steps"]]
        seed = path.stem.removeprefix("explorer_seed")
        cells = [seed, *(f"{value:.1f}" for value in steps)]
        assert "| " + " | ".join(cells) + " |" in PAGE, cells
