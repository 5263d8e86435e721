"""A run has a folder of its own, whoever starts it and whenever, and a failed one leaves none."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from omegaconf import OmegaConf

from tests.commands import SHORT, forestrl, rows, train

ROOT = Path(__file__).resolve().parents[1]
CLAIM = """
import sys
from hydra.core.hydra_config import HydraConfig
from tests.commands import compose
from forestrl.runs import OwnFolder, Refusal
kind, *overrides = sys.argv[1:]
cfg = compose("train", *overrides, return_hydra_config=True)
cfg.hydra.job.name = "train"
HydraConfig.instance().set_config(cfg)
try:
    getattr(OwnFolder(), f"on_{kind}_start")(cfg)
except Refusal as refusal:
    print("refused:", refusal.__cause__, flush=True)
else:
    print(cfg.hydra.run.dir if kind == "run" else cfg.hydra.sweep.dir, flush=True)
sys.stdin.read()
"""
SAME_SECOND = "runs/${now:%Y}"
EVALUATION = ("eval", "env=tiny", "policy=random", "eval.arenas=2", "eval.steps=5")


@pytest.fixture
def claim(tmp_path):
    """Starts a process that claims a folder and keeps it; gives what it says."""
    processes = []

    def start(*words, stop=False):
        process = subprocess.Popen(
            [sys.executable, "-c", CLAIM, *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )
        processes.append(process)
        said = process.stdout.readline().strip()
        if stop:
            process.kill()
            process.wait()
        return said

    yield start
    for process in processes:
        process.communicate()


@pytest.mark.parametrize(
    ("kind", "name"), [("run", "hydra.run.dir"), ("multirun", "hydra.sweep.dir")]
)
def test_two_runs_started_at_the_same_time_have_two_folders(kind, name, claim):
    year = Path(claim(kind, f"{name}={SAME_SECOND}")).name
    assert claim(kind, f"{name}={SAME_SECOND}") == f"runs/{year}-2"
    assert claim(kind, f"{name}={SAME_SECOND}") == f"runs/{year}-3"


@pytest.mark.parametrize("name", ["a", "a b=c,d", "it's 'quoted' \\"])
def test_the_jobs_of_a_sweep_are_told_its_folder(name, tmp_path, monkeypatch):
    """Also with a name that means something to Hydra or the shell."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / name
    words = ("experiment=smoke", "env.size=14,15", *SHORT)
    escaped = str(folder).replace("\\", "\\\\").replace("'", "\\'")
    result = forestrl("train", "-m", *words, f"hydra.sweep.dir='{escaped}'")
    assert result.status == 0, result.err
    assert {path.name for path in folder.iterdir()} == {"0", "1", "multirun.yaml"}
    assert OmegaConf.load(folder / "1/.hydra/config.yaml").env.size == 15


def test_a_folder_in_use_is_refused(claim):
    assert claim("run", "hydra.run.dir=mine") == "mine"
    said = claim("run", "hydra.run.dir=mine")
    assert said.startswith("refused: hydra.run.dir=mine is not allowed: another run is writing")


def test_what_a_killed_run_left_is_no_obstacle_if_it_is_empty(claim, tmp_path):
    assert claim("run", "hydra.run.dir=mine", stop=True) == "mine"
    (tmp_path / "mine/.hydra/config.yaml").touch()
    (tmp_path / "mine/train.log").touch()
    (tmp_path / "mine/.metrics.csv.0123abcd.part").touch()
    assert claim("run", "hydra.run.dir=mine", stop=True) == "mine"
    (tmp_path / "mine/metrics.csv").touch()
    assert "it holds a run already" in claim("run", "hydra.run.dir=mine")


def test_a_finished_run_is_not_written_over(tmp_path):
    run = train(tmp_path / "run", *SHORT)
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    result = forestrl("train", "experiment=smoke", f"hydra.run.dir={run}", "seed=1", *SHORT)
    assert result.status == 1
    (line,) = result.err.splitlines()
    assert f"hydra.run.dir={run} is not allowed: it holds a run already" in line
    assert f"resume={run}" in line
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before


def test_a_sweep_is_not_mixed_with_an_older_one(tmp_path):
    words = ("train", "experiment=smoke", "-m", f"hydra.sweep.dir={tmp_path}/sweep", *SHORT)
    assert forestrl(*words, "seed=0,1").status == 0
    result = forestrl(*words, "seed=2")
    assert result.status == 1 and "it holds a run already" in result.err
    assert sorted(path.name for path in (tmp_path / "sweep").glob("[0-9]*")) == ["0", "1"]
    assert OmegaConf.load(tmp_path / "sweep/0/.hydra/config.yaml").seed == 0


def test_tables_without_a_run_are_no_obstacle(tmp_path):
    """As in a fresh checkout, where the published tables lie without what Hydra wrote."""
    (tmp_path / "summary.json").touch()
    assert forestrl(*EVALUATION, f"hydra.run.dir={tmp_path}").status == 0
    assert (tmp_path / "summary.json").read_text()


@pytest.mark.parametrize(
    "words",
    [
        ("train", "env.size=large"),
        ("train", "env.n_trees=100000", "env=tiny"),
        ("train", "-m", "env.sizze=1,2"),
        ("eval", "checkpoint=nothere"),
        ("eval", "resume=TYPO"),
    ],
)
def test_a_failed_command_leaves_nothing(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert forestrl(*words).status == 1
    assert list(tmp_path.iterdir()) == []


def test_a_failed_command_leaves_what_was_there_before(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "outputs/train").mkdir(parents=True)
    (tmp_path / "mine").mkdir()
    for words in ((), ("hydra.run.dir=mine",)):
        assert forestrl("train", "env.size=large", *words).status == 1
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["mine", "outputs", "train"]


def test_a_run_that_fails_on_the_way_keeps_what_it_wrote(tmp_path):
    (tmp_path / "checkpoints").touch()
    assert forestrl("train", "experiment=smoke", f"hydra.run.dir={tmp_path}").status == 1
    assert rows(tmp_path / "metrics.csv")[0]["frames"] == "256"
    assert (tmp_path / ".hydra/config.yaml").is_file()


def test_a_resumed_run_goes_on_in_its_own_folder_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    train(Path("run"), *SHORT)
    result = forestrl("train", "resume=run", "total_frames=512")
    assert result.status == 0, result.err
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
    assert [row["frames"] for row in rows(tmp_path / "run/metrics.csv")] == ["256", "512"]
    assert OmegaConf.load("run/.hydra/config.yaml").total_frames == 512  # as it went on


def test_two_processes_cannot_go_on_with_the_same_run(claim, tmp_path):
    train(tmp_path / "run", *SHORT)
    assert claim("run", "resume=run") == "run"
    assert claim("run", "resume=run").endswith(
        "resume=run is not allowed: another run is writing into it"
    )


def test_a_resume_is_a_run_of_the_same_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert forestrl(*EVALUATION, "hydra.run.dir=done").status == 0
    for command, folder, words in (
        ("eval", "TYPO", "resume=TYPO is not a run folder"),
        ("eval", "/", "resume=/ is not a run folder"),
        ("train", "done", "resume=done is a run of forestrl eval, not of train"),
    ):
        result = forestrl(command, f"resume={folder}")
        assert result.status == 1 and words in result.err


def test_the_latest_checkpoint_is_that_of_the_newest_training(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ("eval", "env=tiny", "eval.arenas=1", "eval.steps=5", "checkpoint=latest")
    result = forestrl(*words)
    assert result.status == 1 and "no training under outputs/train has a policy" in result.err
    for name in ("b", "a"):
        train(Path("outputs/train") / name, *SHORT)
    result = forestrl(*words, "hydra.run.dir=out")
    assert result.status == 0, result.err
    assert "checkpoint=latest: outputs/train/a" in result.err
    assert "outputs/train/a" in (tmp_path / "out/summary.json").read_text()
    (tmp_path / "latest").touch()  # a file of that name is meant then
    assert "latest cannot be read as a policy" in forestrl(*words).err
