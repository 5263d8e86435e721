"""The command: what it measures and writes; never how fast anything is."""

import csv
import json

import pytest
import torch

from forestrl import kernels
from tests.commands import forestrl
from tests.docs.pages import blocks

STEPS = ["env step", "+ filter", "+ graph", "+ reward", "policy forward"]
LEARNING = ["GAE", "PPO minibatches", "train iteration"]
DECISIONS = ["decision", "decision + filter", "decision from the map"]
SHORT = [
    "env.max_steps=60",
    "algo.frames_per_batch=32",
    "algo.num_minibatches=2",
    "algo.num_epochs=4",
    "bench.seconds=0.001",
]
TINY = [*SHORT, "bench.sizes=[20]", "bench.num_envs=[1,4,5]"]


def bench(folder, *overrides):
    """Runs ``forestrl bench``; gives the rows of the CSV file and what was printed."""
    result = forestrl("bench", *overrides, f"hydra.run.dir={folder}")
    assert result.status == 0, result.err
    return list(csv.DictReader((folder / "bench.csv").open(newline=""))), result.out


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    more = ["bench.scaling=true", "bench.scaling_sizes=[20,30]", "bench.scaling_num_envs=[1,2]"]
    return folder, *bench(folder, *TINY, *more)


def stages(measured, **where):
    chosen = (row for row in measured if all(row[name] == value for name, value in where.items()))
    return [row["stage"] for row in chosen]


def test_every_stage_is_there_for_every_number_of_arenas(result):
    _, rows, _ = result
    table = "20 x 20 cells: a frame"
    whole = [*STEPS, *LEARNING, "evaluation step"]
    assert stages(rows, table=table, num_envs="1") == whole
    assert stages(rows, table=table, num_envs="4") == whole
    assert stages(rows, table="20 x 20 cells: a decision") == DECISIONS


def test_rows_of_the_csv_file_agree_with_themselves(result):
    _, rows, _ = result
    for row in rows:
        assert float(row["seconds"]) > 0 and float(row["iqr"]) >= 0
        assert float(row["frames_per_second"]) == pytest.approx(1 / float(row["seconds"]), rel=1e-4)
        assert int(row["repeats"]) >= 1
        side = int(row["rows"])
        assert (side, row["n_trees"]) in ((20, "7"), (30, "16"))
        assert row["columns"] == row["rows"] and 0 < float(row["coverage"]) <= 1
    keys = [tuple(row[name] for name in ("table", "stage", "version", "num_envs")) for row in rows]
    assert len(set(keys)) == len(keys)


def test_frames_are_those_that_a_call_is_worth(result):
    _, rows, _ = result
    four = {row["stage"]: float(row["frames"]) for row in rows if row["num_envs"] == "4"}
    assert {four[stage] for stage in (*STEPS, "evaluation step")} == {4}
    assert four["GAE"] == four["train iteration"] == 32
    assert four["PPO minibatches"] == 16 / 4  # of 16 frames, each in 4 epochs


def test_arenas_that_do_not_divide_a_batch_learn_nothing_and_it_is_said(result):
    _, rows, output = result
    assert stages(rows, num_envs="5") == [*STEPS, "evaluation step"]
    assert "learning with [5] arenas" in output


def test_scaling_times_steps_alone_and_compares_their_cost_with_their_work(result):
    _, rows, output = result
    for arenas in ("1", "2"):
        assert stages(rows, rows="30", num_envs=arenas) == [*STEPS, "evaluation step"]
    (line,) = (line for line in output.splitlines() if line.startswith("growth"))
    assert all(f"{stage} " in line for stage in (*STEPS, "evaluation step"))


def test_only_single_decisions_have_a_99th_percentile(result):
    _, rows, output = result
    tails = {row["stage"]: row["percentile_99"] for row in rows if row["percentile_99"]}
    assert list(tails) == DECISIONS
    for row in rows:
        if row["stage"] in tails:
            assert float(row["percentile_99"]) >= float(row["seconds"])
    assert "99th percentile, us: decision " in output


def test_every_compiled_function_stands_beside_its_reference(result):
    _, rows, output = result
    table = "20 x 20 cells: a map or graph"
    functions = [*kernels.__all__, "GATv2 forward + backward"]
    assert sorted(stages(rows, table=table, version="reference")) == sorted(functions)
    assert stages(rows, table=table, version="plain loops") == ["GATv2 attention"]
    compiled = stages(rows, table=table, version="compiled")
    assert sorted(compiled) == sorted([*functions, "GATv2 attention"])
    (line,) = (line for line in output.splitlines() if "beside reference, times" in line)
    assert all(f"{function} " in line for function in functions)


def test_the_report_names_machine_and_versions_and_holds_every_stage(result):
    folder, rows, output = result
    machine = json.loads((folder / "machine.json").read_text())
    assert {"processor", "cores", "threads", "python", "torchrl", "numba"} <= machine.keys()
    assert machine["torch"] == torch.__version__ and machine["kernel"] == "fused"
    assert all(name in output and value in output for name, value in machine.items())
    assert all(row["stage"] in output for row in rows)
    assert (folder / "bench.txt").read_text().strip() in output


def test_another_network_no_filter_and_one_size_can_be_asked_for(tmp_path):
    one = ["env.size=12", "env.n_trees=2", "env.num_envs=2"]
    rows, _ = bench(tmp_path, *SHORT, *one, "model.kernel=pyg", "safety=none")
    assert {(row["rows"], row["n_trees"]) for row in rows} == {("12", "2")}
    steps = [stage for stage in STEPS if stage != "+ filter"]
    found = stages(rows, table="12 x 12 cells: a frame")
    assert found == [*steps, *LEARNING, "evaluation step"]
    assert json.loads((tmp_path / "machine.json").read_text())["kernel"] == "pyg"


@pytest.mark.slow
def test_a_foreign_world_observation_and_network_are_measured(tmp_path, monkeypatch):
    for block in blocks("docs/extend.md"):
        if block.file:
            (tmp_path / block.file).parent.mkdir(parents=True, exist_ok=True)
            with (tmp_path / block.file).open("a") as file:
                file.write(block.text)
    monkeypatch.syspath_prepend(tmp_path)
    ours = [f"{group}=mine" for group in ("env", "graph", "model", "reward")]
    rows, _ = bench(tmp_path, "--config-dir", tmp_path / "my_conf", *SHORT, *ours)
    assert {(row["rows"], row["columns"], row["n_trees"]) for row in rows} == {("12", "21", "")}
    found = stages(rows, table="12 x 21 cells: a frame", num_envs="4")
    assert found == [*STEPS, *LEARNING, "evaluation step"]
    assert stages(rows, table="12 x 21 cells: a decision") == DECISIONS[:2]


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("bench.num_envs=[0]", "bench.num_envs=[0] is not allowed"),
        ("bench.num_envs=[]", "bench.num_envs=[] is not allowed"),
        ("bench.sizes=[2]", "bench.sizes=[2] is not allowed"),
        ("bench.sizes=[large]", "bench.sizes=[large] is not allowed"),
        ("bench.seconds=0", "bench.seconds=0 is not allowed"),
    ],
)
def test_bad_settings_end_with_one_line(override, words, tmp_path):
    result = forestrl("bench", *TINY, override, f"hydra.run.dir={tmp_path}")
    assert result.status == 1
    (line,) = result.err.splitlines()
    assert line.startswith("forestrl bench: ") and words in line
    assert not list(tmp_path.glob("*.csv"))
