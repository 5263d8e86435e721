"""The commands as people type them."""

import csv
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from omegaconf import OmegaConf
from PIL import Image

from forestrl.policies.files import load_policy
from tests.commands import SHORT, forestrl, rows, train

ARENAS = ("env=tiny", "graph.max_frontiers=64", "eval.steps=30")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return train(tmp_path_factory.mktemp("run"))


def evaluate(folder, *arguments):
    result = forestrl("eval", *ARENAS, f"hydra.run.dir={folder}", *arguments)
    assert result.status == 0, result.err
    return folder


def test_train_leaves_a_whole_run_folder(run):
    assert [row["frames"] for row in rows(run / "metrics.csv")] == ["256", "512", "768", "1024"]
    for alias in ("best", "latest"):
        assert load_policy(run / "checkpoints" / alias).training["env"]["size"] == 14
    assert (run / "checkpoints/latest/training.pt").is_file()
    with Image.open(run / "episode.gif") as episode:
        assert episode.n_frames > 2
    assert OmegaConf.load(run / ".hydra/config.yaml").total_frames == 1024
    assert list(OmegaConf.load(run / ".hydra/overrides.yaml")) == ["experiment=smoke"]
    assert not list(run.rglob(".*.part")) and not list(run.glob(".writable*"))


@pytest.mark.parametrize("name", ["run", "a run", "beta=0.5,1", 'it\'s "quoted" \\', "1e3", "null"])
def test_the_next_command_that_train_tells_can_be_pasted(name, tmp_path, monkeypatch):
    """Words as the shell parts them, also where the folder means something to Hydra."""
    monkeypatch.chdir(tmp_path)
    escaped = name.replace("\\", "\\\\").replace("'", "\\'")
    result = forestrl("train", "experiment=smoke", f"hydra.run.dir='{escaped}'", *SHORT)
    assert result.status == 0, result.err
    told = result.out.splitlines()[-1]
    assert told.startswith("next: forestrl eval ")
    words = shlex.split(told.removeprefix("next: forestrl"))
    result = forestrl(*words, *ARENAS, "eval.arenas=1", "hydra.run.dir=out")
    assert result.status == 0, result.err
    summary = json.loads((tmp_path / "out/summary.json").read_text())
    assert summary["meta"]["checkpoint"] == str(tmp_path / name)


def test_train_tells_its_coverage_in_test_arenas_or_that_there_is_none(tmp_path):
    folder = f"hydra.run.dir={tmp_path}"
    result = forestrl("train", "experiment=smoke", f"{folder}/1", "total_frames=256")
    assert re.search(r"coverage +[\d.]+% in test arenas\n", result.out)
    result = forestrl("train", "experiment=smoke", f"{folder}/2", *SHORT)
    assert re.search(r"coverage +[\d.]+% in training episodes, cut short at first", result.out)


def test_the_same_seed_gives_the_same_metrics(run, tmp_path):
    assert rows(train(tmp_path) / "metrics.csv") == rows(run / "metrics.csv")


def test_another_seed_gives_others(run, tmp_path):
    other = train(tmp_path, "seed=1", *SHORT)
    assert rows(other / "metrics.csv")[0] != rows(run / "metrics.csv")[0]


def test_a_sweep_makes_a_folder_a_job(tmp_path, monkeypatch):
    """``-m`` stands where one likes, and the folder is under ``multirun/``."""
    monkeypatch.chdir(tmp_path)
    result = forestrl("train", "experiment=smoke", "-m", "reward.beta=0.25,0.5,1.0", *SHORT)
    assert result.status == 0, result.err
    (sweep,) = (tmp_path / "multirun").iterdir()
    jobs = [folder for folder in sorted(sweep.iterdir()) if folder.is_dir()]
    assert [folder.name for folder in jobs] == ["0", "1", "2"]
    configs = [OmegaConf.load(folder / ".hydra/config.yaml") for folder in jobs]
    assert [cfg.reward.beta for cfg in configs] == [0.25, 0.5, 1.0]
    potentials = {rows(folder / "metrics.csv")[0]["reward/potential"] for folder in jobs}
    assert len(potentials) == 3


def test_a_job_that_fails_does_not_stop_the_sweep(tmp_path):
    sweep = ("-m", "env.size=2,14", f"hydra.sweep.dir={tmp_path}")
    result = forestrl("train", "experiment=smoke", *sweep, *SHORT)
    assert result.status == 1
    assert "env.size=2 is not allowed: it must be" in result.err.splitlines()[-1]
    assert len(rows(tmp_path / "1/metrics.csv")) == 1


def test_eval_writes_its_report(run, tmp_path):
    evaluate(tmp_path, f"checkpoint={run}", "eval.arenas=3")
    assert [row["index"] for row in rows(tmp_path / "episodes.csv")] == ["0", "1", "2"]
    assert len(rows(tmp_path / "curve.csv")) == 4  # 0, 10, 20, 30
    for name in ("coverage.png", "interventions.png"):
        with Image.open(tmp_path / name) as picture:
            assert picture.format == "PNG"
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["arenas"], summary["steps"]) == (3, 30)
    assert {"measure": "collisions", "mean": 0.0, "low": None, "high": None, "n": 3} in summary[
        "measures"
    ]
    assert summary["meta"]["training"]["frames"] in (512, 1024)


@pytest.mark.parametrize(
    "policy", ["learned", "learned policy.deterministic=true", "random", "nearest_frontier"]
)
def test_an_arena_fares_the_same_alone_and_among_ten(policy, run, tmp_path):
    options = f"policy={policy}".split()
    options += [f"checkpoint={run}"] * policy.startswith("learned")
    alone = evaluate(tmp_path / "1", *options, "eval.first=7", "eval.arenas=1")
    among = evaluate(tmp_path / "10", *options, "eval.arenas=10", "eval.batch=4")
    assert rows(alone / "episodes.csv") == [rows(among / "episodes.csv")[7]]


def test_render_draws_an_episode(run, tmp_path):
    options = (f"checkpoint={run}", "render.steps=8", "render.frames=true")
    result = forestrl("render", *ARENAS[:2], f"hydra.run.dir={tmp_path}", *options)
    assert result.status == 0, result.err
    with Image.open(tmp_path / "episode.gif") as episode:
        assert episode.n_frames == len(list((tmp_path / "frames").glob("*.png")))


def test_with_the_filter_there_are_no_collisions_and_without_it_there_are(run, tmp_path):
    assert {row["safety/collisions"] for row in rows(run / "metrics.csv")} == {"0"}
    bare = rows(train(tmp_path / "train", "safety=none", *SHORT) / "metrics.csv")
    assert int(bare[0]["safety/collisions"]) > 0
    options = ("policy=random", "policy.feasible_only=false", "eval.arenas=5")
    for safety in ("filter", "none"):
        report = evaluate(tmp_path / safety, f"safety={safety}", *options) / "summary.json"
        measures = json.loads(report.read_text())["measures"]
        (collisions,) = (row["mean"] for row in measures if row["measure"] == "collisions")
        assert (collisions > 0) == (safety == "none")


def test_metrics_can_be_read_by_any_program(run):
    with (run / "metrics.csv").open(newline="") as file:
        table = list(csv.reader(file))
    assert {len(row) for row in table} == {len(table[0])}
    assert all(value == "" or float(value) is not None for row in table[1:] for value in row)


THREADS = """
import torch
from forestrl import build
from tests.commands import compose
build.prepare(compose("train", "env=tiny"))
env = build.make_training_env(compose("train", "env=tiny"))
env.rollout(3)
assert torch.get_num_threads() == 1, torch.get_num_threads()
"""


def test_threads_are_those_of_the_configuration_in_a_new_process():
    names = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "MKL_NUM_THREADS")
    inherited = {name: value for name, value in os.environ.items() if name not in names}
    run = [sys.executable, "-c", THREADS]
    subprocess.run(run, env=inherited, check=True, cwd=Path(__file__).parents[1])
