"""The commands as people type them."""

import csv
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hydra.errors import InstantiationException
from omegaconf import OmegaConf
from PIL import Image

from forestrl.policies.files import POLICY_FILE, Described, load_policy, save_policy
from tests.commands import SHORT, forestrl, rows, train

ROOT = Path(__file__).resolve().parents[1]
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


def test_train_tells_the_next_command(tmp_path):
    result = forestrl("train", "experiment=smoke", f"hydra.run.dir={tmp_path}", *SHORT)
    assert result.out.splitlines()[-1] == f"next: forestrl eval checkpoint={tmp_path}"


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
    assert result.err.splitlines()[-1].endswith(
        "must be a side or [rows, columns] of at least 3 cells"
    )
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
    options = [f"checkpoint={run}", *f"policy={policy}".split()]
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


REFUSED = [
    ("nope=1", "there is no setting 'nope'"),
    ("env.size=2", "shape=2 .*at least 3"),
    ("env.size=large", "env.size=large .*a whole number"),
    ("env.size=14.5", "env.size=14.5 .*a whole number"),
    ("env.n_trees=-1", "n_trees=-1 .*0 or more"),
    ("env.n_trees=100000", "n_trees=100000 .*no free cell .*14 x 14"),
    ("env.tree_radius=[3,1]", r"tree_radius=\[3, 1\] .*smallest, largest"),
    ("env.tree_radius=3", "env.tree_radius=3 .*a list"),
    ("env.num_envs=3", "env.num_envs=3 .*divide algo.frames_per_batch=256"),
    ("graph.window=4", "window=4 .*odd and at least 1"),
    ("graph.window=-1", "window=-1 .*odd and at least 1"),
    ("reward.beta=-1", "beta=-1 .*0 or more"),
    ("reward.beta=nan", "reward.beta=nan .*a number"),
    ("env.coverage_goal=0", r"coverage_goal=0 .*in \(0, 1\]"),
    ("env.coverage_goal=1.5", r"coverage_goal=1.5 .*in \(0, 1\]"),
    ("algo.num_minibatches=7", "num_minibatches=7 .*divide frames_per_batch=256"),
    ("total_frames=0", "total_frames=0 .*at least 1"),
    ("episode_steps=0", "episode_steps=0 .*at least 1"),
    ("eval.steps=0", "eval.steps=0 .*at least 1"),
    ("threads=0", "threads=0 .*at least 1"),
    ("seed=-1", "seed=-1 .*0 or more"),
    ("debug=maybe", "debug=maybe .*true or false"),
    ("device=cuda:7", "device=cuda:7 is not there.*cpu"),
    ("device=toaster", "device=toaster is not there.*cpu"),
    ("logger=nope", "logger/nope.*csv none tensorboard wandb$"),
    ("resume=/usr", "resume=/usr is not a run folder"),
    ("resume=0", "resume=0 is not a run folder"),
]


def refusal(result):
    """The one line that a refused command says."""
    assert result.status == 1
    (line,) = result.err.splitlines()
    return line


@pytest.mark.parametrize(("setting", "expected"), REFUSED)
def test_what_is_not_allowed_is_said_in_one_line(setting, expected, tmp_path):
    result = forestrl("train", "experiment=smoke", setting, f"hydra.run.dir={tmp_path}")
    line = refusal(result)
    assert line.startswith("forestrl train: ")
    assert re.search(expected, line)


def test_an_output_folder_that_cannot_be_written_is_said_in_one_line(tmp_path):
    (tmp_path / "file").touch()
    folder = tmp_path / "file/run"
    assert str(folder) in refusal(forestrl("train", f"hydra.run.dir={folder}"))


@pytest.fixture
def policy_file(run, tmp_path):
    policy = load_policy(run)
    graph = Described("exploration_graph", {"window": 9})
    save_policy(tmp_path / POLICY_FILE, replace(policy, observation=graph))
    return tmp_path / POLICY_FILE


@pytest.mark.parametrize("name", ["eval", "render"])
def test_checkpoints_that_do_not_do_are_said_in_one_line(name, policy_file, tmp_path):
    def line(checkpoint, *settings):
        folder = f"hydra.run.dir={tmp_path}/out"
        return refusal(forestrl(name, *ARENAS[:2], f"checkpoint={checkpoint}", folder, *settings))

    assert f"checkpoint={tmp_path}/none does not exist" in line(tmp_path / "none")
    assert "was made with model.heads=4, but model.heads=2 was" in line(
        policy_file, "model.heads=2"
    )
    assert "was made with graph.window=9, but graph.window=7 was" in line(
        policy_file, "graph.window=7"
    )
    policy_file.write_bytes(policy_file.read_bytes()[:200])
    assert f"checkpoint={policy_file} cannot be read" in line(policy_file)


def test_a_policy_brings_its_own_window(policy_file, tmp_path):
    evaluate(tmp_path / "out", f"checkpoint={policy_file}", "eval.arenas=1")


def test_debug_lets_the_error_through(tmp_path):
    with pytest.raises(InstantiationException) as caught:
        forestrl("train", "env.size=2", "debug=true", f"hydra.run.dir={tmp_path}")
    assert "shape=2" in str(caught.value.__cause__)


def test_the_process_ends_with_the_status_and_only_debug_prints_a_traceback(tmp_path):
    for settings, traced in ((["env.size=2"], False), (["env.size=2", "debug=true"], True)):
        words = [sys.executable, "-m", "forestrl.train", f"hydra.run.dir={tmp_path}", *settings]
        result = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
        assert result.returncode == 1
        assert ("Traceback (most recent call last)" in result.stderr) is traced
        assert traced or result.stderr.count("\n") == 1


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
