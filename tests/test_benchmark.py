"""The benchmark: what it measures and writes; never how fast anything is."""

import csv
import json
import math

import pytest
import torch

from forestrl import functional as F
from forestrl import kernels
from forestrl import keys as K
from forestrl.benchmark.states import arrange, enter, explore
from forestrl.benchmark.timing import measure
from tests.commands import forestrl
from tests.envs.worlds import forest_env

DECISIONS = ("decision", "decision + filter", "graph to filter")
PIPELINE = [
    "env step",
    "+ filter",
    "+ graph",
    "+ reward",
    "policy forward",
    "GAE",
    "PPO minibatch",
]
TINY = [
    "env.max_steps=60",
    "algo.frames_per_batch=32",
    "algo.num_minibatches=2",
    "algo.num_epochs=1",
    "bench.sizes=[20]",
    "bench.num_envs=[1,4,5]",
    "bench.seconds=0.005",
]


def bench(folder, *overrides):
    """Runs ``forestrl bench``, tiny unless said otherwise."""
    return forestrl("bench", *TINY, *overrides, f"hydra.run.dir={folder}")


def read(path):
    return list(csv.DictReader(path.open(newline="")))


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    scaling = ["bench.scaling_sizes=[20,30]", "bench.scaling_num_envs=[1,2]", "bench.scaling=true"]
    process = bench(folder, *scaling)
    assert process.status == 0, process.err
    return folder, process.out, read(folder / "bench.csv")


def test_every_stage_is_there_for_every_number_of_arenas(result):
    rows = result[2]
    whole = {*PIPELINE, "train iteration", "evaluation step"}
    for num_envs, stages in (("1", {*whole, *DECISIONS}), ("4", whole)):
        assert {row["stage"] for row in rows if row["num_envs"] == num_envs} == stages
    assert {(row["size"], row["n_trees"]) for row in rows} == {("20", "7")}


def test_every_stage_takes_time(result):
    measured = [row for row in result[2] if not row["how"].startswith("skipped")]
    for row in measured:
        assert float(row["seconds"]) > 0
        speed = float(row["frames"]) / float(row["seconds"])
        assert float(row["frames_per_second"]) == pytest.approx(speed, rel=1e-4)
        assert float(row["peak_memory_gb"]) > 0
        assert int(row["repeats"]) >= 1
        assert row["how"] in ("measured", "estimated")


def test_arenas_that_do_not_divide_a_batch_are_skipped_and_said_so(result):
    _, output, rows = result
    skipped = [row for row in rows if row["how"].startswith("skipped")]
    assert {row["num_envs"] for row in skipped} == {"5"}
    assert {row["stage"] for row in skipped} == {"GAE", "PPO minibatch", "train iteration"}
    assert all(row["seconds"] == row["share"] == "" for row in skipped)
    assert "num_envs 5: skipped" in output


@pytest.mark.parametrize("num_envs", ["1", "4"])
def test_shares_of_the_pipeline_add_up(num_envs, result):
    shares = {
        row["stage"]: float(row["share"])
        for row in result[2]
        if row["num_envs"] == num_envs and row["share"]
    }
    assert list(shares) == PIPELINE
    assert all(share >= 0 for share in shares.values())
    assert math.fsum(shares.values()) == pytest.approx(1, abs=1e-4)


def test_decisions_have_a_99th_percentile(result):
    decisions = [row for row in result[2] if row["stage"].startswith("decision")]
    assert len(decisions) == 2
    assert all(float(row["percentile_99"]) >= float(row["seconds"]) for row in decisions)


def test_table_names_machine_and_versions(result):
    folder, output, _ = result
    machine = json.loads((folder / "machine.json").read_text())
    assert {"processor", "cores", "threads", "python", "torch", "torchrl", "numba"} <= {*machine}
    assert machine["torch"] == torch.__version__
    assert all(name in output and value in output for name, value in machine.items())
    assert (folder / "bench.txt").read_text().strip() in output


def test_every_compiled_function_is_set_beside_its_reference(result):
    folder, output, _ = result
    rows = read(folder / "compiled.csv")
    assert [row["function"] for row in rows] == [
        "sense",
        "exploration_graph",
        "potential",
        "path_lengths",
        "component",
        "largest_component",
        "GATv2 forward + backward",
    ]
    assert {row["function"] for row in rows[:-1]} == set(kernels.__all__)
    for row in rows:
        ratio = float(row["reference"]) / float(row["compiled"])
        assert float(row["ratio"]) == pytest.approx(ratio, rel=1e-4)
        assert int(row["batch"]) == (64 if row["function"] in kernels.__all__ else 16)
    assert (folder / "compiled.txt").read_text().rstrip() in output


def test_scaling_has_a_row_for_every_stage_size_and_number_of_arenas(result):
    folder, output, _ = result
    rows = read(folder / "scaling.csv")
    stages = [*PIPELINE[:5], "evaluation step"]
    cells = {(row["stage"], row["size"], row["num_envs"]) for row in rows}
    assert cells == {(s, h, n) for s in stages for h in ("20", "30") for n in ("1", "2")}
    assert len(rows) == len(cells)
    assert all(float(row["seconds"]) > 0 for row in rows)
    assert all(float(row["growth"]) == 1 for row in rows if row["size"] == "20")
    assert (folder / "scaling.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "scaling.txt").read_text().strip() in output


@pytest.mark.slow
def test_another_network_no_filter_and_a_single_size_can_be_asked_for(tmp_path):
    chosen = ["model.kernel=pyg", "safety=none", "env.size=12", "env.n_trees=2", "env.num_envs=2"]
    chosen.append("bench.seconds=0.005")
    result = forestrl("bench", *TINY[:4], *chosen, f"hydra.run.dir={tmp_path}")
    assert result.status == 0, result.err
    rows = read(tmp_path / "bench.csv")
    assert {(row["size"], row["num_envs"]) for row in rows} == {("12", "1"), ("12", "2")}
    assert "+ filter" not in {row["stage"] for row in rows}
    assert json.loads((tmp_path / "machine.json").read_text())["kernel"] == "pyg"


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("bench.num_envs=[0]", "bench.num_envs=[0] is not allowed"),
        ("bench.num_envs=[]", "bench.num_envs=[] is not allowed"),
        ("bench.sizes=[2]", "bench.sizes=[2] is not allowed"),
        ("bench.sizes=[large]", "bench.sizes=['large'] is not allowed"),
        ("bench.seconds=0", "bench.seconds=0 is not allowed"),
    ],
)
def test_bad_settings_end_with_one_line(override, words, tmp_path):
    process = bench(tmp_path, override)
    assert process.status == 1
    (line,) = process.err.splitlines()
    assert line.startswith("forestrl bench: ") and words in line
    assert not list(tmp_path.glob("*.csv"))


@pytest.fixture(scope="module")
def forest():
    return forest_env(size=20, n_trees=8, num_envs=6)


@pytest.fixture(scope="module")
def worlds(forest):
    return explore(forest, steps=300)


def test_states_are_explored_and_in_different_phases(worlds):
    known = (worlds["cells"] != F.Cell.UNKNOWN).sum((-2, -1))
    assert (known > 0).all()
    assert len(set(worlds["phase"].tolist())) > 1
    assert (worlds["position"] != worlds["start"]).any()
    on_a_trunk = F.gather(worlds["trees"], worlds["position"].unsqueeze(-2), outside=True)
    assert not on_a_trunk.any()


@pytest.mark.parametrize(("num_envs", "batches"), [(1, 6), (4, 1), (6, 1), (8, 1)])
def test_batches_are_filled_with_the_pool(num_envs, batches, worlds):
    arranged = arrange(worlds, num_envs)
    assert [len(batch) for batch in arranged] == [num_envs] * batches
    assert torch.equal(arranged[-1]["cells"][-1], worlds["cells"][(batches * num_envs - 1) % 6])


def test_entered_env_stands_in_the_world(forest, worlds):
    state = enter(forest, worlds)
    assert torch.equal(state[K.CELLS], worlds["cells"])
    assert torch.equal(state[K.POSITION], worlds["position"])
    assert torch.equal(state[K.STEP_COUNT].squeeze(-1), worlds["phase"])


def test_calls_are_timed_in_turns_after_a_warm_up():
    called = []
    timings = measure(
        {name: lambda name=name: called.append(name) for name in "ab"}, seconds=0, least=4
    )
    assert "".join(called) == "abab" + "abababab"
    assert [timing.repeats for timing in timings.values()] == [4, 4]
    assert all(0 < t.median <= t.percentile_99 for t in timings.values())
