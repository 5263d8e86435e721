"""Where metrics go: CSV, TensorBoard, and Weights & Biases without an account."""

import csv
import json
import math
import subprocess
import sys

import pytest
from omegaconf import OmegaConf
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from forestrl.loggers import (
    CsvLogger,
    Loggers,
    NoLogger,
    Run,
    TensorboardLogger,
    WandbLogger,
)
from tests.commands import forestrl, rows, train

ROLLOUT = "return coverage episode_length steps_to_80 steps_to_90 steps_to_98 finished"
EVAL = "coverage auc steps_to_80 steps_to_95 steps_to_98 intervention_rate collisions"
NAMES = {
    f"{section}/{name}"
    for section, names in {
        "rollout": ROLLOUT,
        "safety": "intervention_rate null_actions collisions",
        "reward": "new_cells potential explored unsafe",
        "loss": "objective critic entropy",
        "ppo": "kl_approx clip_fraction explained_variance grad_norm",
        "graph": "frontiers truncated",
        "eval": EVAL,
        "time": "fps collect update memory",
    }.items()
    for name in names.split()
}


def table(path):
    with path.open(newline="") as file:
        return list(csv.reader(file))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "metrics.csv"


def test_csv_has_a_row_a_call_and_frames_first(path):
    logger = CsvLogger(Run(path.parent))
    logger.log_metrics({"a": 1.0, "b": 0.123456789}, step=10)
    logger.log_metrics({"a": 2.5, "b": -1e-9}, step=20)
    assert table(path) == [["frames", "a", "b"], ["10", "1", "0.123457"], ["20", "2.5", "-1e-09"]]


def test_csv_leaves_nan_and_what_is_missing_empty(path):
    logger = CsvLogger(Run(path.parent))
    logger.log_metrics({"a": math.nan, "b": 1.0}, step=10)
    logger.log_metrics({"b": 2.0}, step=20)
    assert table(path)[1:] == [["10", "", "1"], ["20", "", "2"]]


def test_csv_appends_columns_that_appear_later(path):
    logger = CsvLogger(Run(path.parent))
    logger.log_metrics({"a": 1.0}, step=10)
    logger.log_metrics({"eval/a": 3.0, "a": 2.0}, step=20)
    logger.log_metrics({"a": 4.0}, step=30)
    assert table(path) == [
        ["frames", "a", "eval/a"],
        ["10", "1", ""],
        ["20", "2", "3"],
        ["30", "4", ""],
    ]


def test_csv_drops_later_rows_when_a_run_goes_on(path):
    logger = CsvLogger(Run(path.parent))
    for step in (10, 20, 30):
        logger.log_metrics({"a": step / 10}, step=step)
    logger = CsvLogger(Run(path.parent, frames=20))
    logger.log_metrics({"a": 9.0, "b": 1.0}, step=30)
    assert table(path) == [["frames", "a", "b"], ["10", "1", ""], ["20", "2", ""], ["30", "9", "1"]]


def test_csv_of_a_new_run_replaces_the_old_one(path):
    CsvLogger(Run(path.parent)).log_metrics({"a": 1.0}, step=10)
    CsvLogger(Run(path.parent))
    assert table(path) == [["frames"]]


def test_no_logger_takes_everything_and_writes_nothing(tmp_path):
    logger = Loggers(NoLogger(), NoLogger())
    logger.log_metrics({"a": 1.0}, step=1)
    logger.log_figure("figure", tmp_path / "a.gif", step=1)
    logger.log_policy(tmp_path / "policy", ["best"])
    logger.close()
    assert logger.id is None and not list(tmp_path.iterdir())


def test_tensorboard_has_the_curves(tmp_path):
    logger = TensorboardLogger(Run(tmp_path))
    logger.log_metrics({"a/b": 1.0, "a/c": math.nan}, step=10)
    logger.log_metrics({"a/b": 2.0}, step=20)
    logger.close()
    events = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    assert events.Tags()["scalars"] == ["a/b"]
    assert [(event.step, event.value) for event in events.Scalars("a/b")] == [(10, 1.0), (20, 2.0)]


def test_tensorboard_is_written_beside_the_csv_file(tmp_path):
    run = train(tmp_path, "logger=tensorboard", "total_frames=256", "eval.every=0")
    assert list((run / "tensorboard").glob("events.*"))
    assert len(table(run / "metrics.csv")) == 2


@pytest.fixture(scope="module")
def dashboard(tmp_path_factory):
    """A training of four updates with W&B, offline and without an account."""
    home = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("WANDB_API_KEY", raising=False)
        patch.setenv("NETRC", str(home / "none"))
        patch.setenv("WANDB_MODE", "offline")
        for name in ("CONFIG_DIR", "CACHE_DIR", "DATA_DIR"):
            patch.setenv(f"WANDB_{name}", str(home / name))
        patch.setenv("WANDB_SILENT", "true")
        yield train(tmp_path_factory.mktemp("run"), "logger=wandb", "logger.group=group")


@pytest.fixture(scope="module")
def records(dashboard):
    """What the run's transaction log holds, a record a line."""
    return [json.loads(line) for line in inspect(dashboard).splitlines()]


def inspect(run, *options):
    (log,) = run.glob("wandb/offline-run-*/run-*.wandb")
    command = [sys.executable, "-m", "wandb", "leet", "inspect", "--json", *options, str(log)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def of_type(records, kind):
    return [record[kind] for record in records if record["type"] == kind]


def test_wandb_has_a_row_an_update_under_the_names_that_dashboards_rely_on(records):
    history = [record["item"] for record in of_type(records, "history")]
    updates = [row for row in history if "time/fps" in row]
    assert [row["frames"] for row in updates] == [256, 512, 768, 1024]
    logged = {name for row in updates for name in row if "/" in name and "episode." not in name}
    assert logged <= NAMES
    assert all("steps_to" in name for name in NAMES - logged)  # nan where a level is not reached
    assert [row["frames"] for row in updates if "eval/auc" in row] == [512, 1024]


def test_wandb_counts_every_metric_in_frames(records):
    (glob,) = (metric for metric in of_type(records, "metric") if "glob_name" in metric)
    assert (glob["glob_name"], glob["step_metric"]) == ("*", "frames")


def test_wandb_has_the_resolved_configuration_and_the_names(records, dashboard):
    (run,) = of_type(records, "run")
    config = run["config"]["update"]
    resolved = OmegaConf.to_container(
        OmegaConf.load(dashboard / ".hydra/config.yaml"), resolve=True
    )
    assert {name: config[name] for name in resolved} == resolved
    assert config["reward"]["window"] == 7
    assert (run["project"], run["job_type"], run["run_group"]) == ("forestrl", "train", "group")
    overrides = ["experiment=smoke", "logger=wandb", "logger.group=group"]
    assert run["display_name"] == ",".join(overrides) and run["tags"] == overrides


def test_wandb_has_an_episode_as_animation(records, dashboard):
    history = [record["item"] for record in of_type(records, "history")]
    (episode,) = (row for row in history if "eval/episode.path" in row)
    (folder,) = dashboard.glob("wandb/offline-run-*/files")
    data = (folder / episode["eval/episode.path"]).read_bytes()
    assert data.startswith(b"GIF8") and len(data) == episode["eval/episode.size"]
    assert episode["frames"] == 1024


def test_wandb_has_the_policy_as_artifact_with_its_aliases(records):
    artifacts = of_type(records, "artifact")
    assert {alias for artifact in artifacts for alias in artifact["aliases"]} == {"best", "latest"}
    assert "best" not in artifacts[-1]["aliases"]
    for artifact in artifacts:
        (content,) = artifact["manifest"]["contents"]
        assert artifact["type"] == "model" and content["path"] == "policy.safetensors"


def test_wandb_run_is_offline_and_finished(records, dashboard):
    assert any(record["feature"].get("offline") for record in of_type(records, "telemetry"))
    summary = json.loads(inspect(dashboard, "--summary"))
    assert (summary["state"], summary["exit_code"]) == ("finished", 0)
    assert summary["entity"] == ""
    assert summary["summary"]["frames"] == 1024


def test_wandb_run_that_fails_is_finished_as_failed(dashboard, tmp_path):
    """The output folder is there, but the place of the checkpoints is taken by a file."""
    (tmp_path / "checkpoints").touch()
    folder = f"hydra.run.dir={tmp_path}"
    result = forestrl("train", "experiment=smoke", "logger=wandb", folder, "eval.every=0")
    assert result.status == 1
    summary = json.loads(inspect(tmp_path, "--summary"))
    assert (summary["state"], summary["exit_code"]) == ("failed", 1)


def test_wandb_of_an_evaluation_has_intervals_episodes_and_a_picture(tmp_path, monkeypatch):
    monkeypatch.setenv("WANDB_MODE", "offline")
    monkeypatch.setenv("WANDB_SILENT", "true")
    options = ("env=tiny", "eval.arenas=3", "eval.steps=12", "logger=wandb")
    result = forestrl("eval", *options, f"hydra.run.dir={tmp_path}")
    assert result.status == 0, result.err
    assert (tmp_path / "metrics.csv").is_file() and (tmp_path / "episode.gif").is_file()
    (media,) = tmp_path.glob("wandb/offline-run-*/files/media")
    kinds = {path.suffix for path in media.rglob("*") if path.is_file()}
    assert {".gif", ".png", ".json"} <= kinds
    (metrics,) = rows(tmp_path / "metrics.csv")
    low, mean, high = (float(metrics[f"eval/coverage{end}"]) for end in ("_low", "", "_high"))
    assert low <= mean <= high


class Failing(NoLogger):
    """A logger that always fails."""

    def log_metrics(self, metrics, step):
        raise RuntimeError("no such host")


class CannotBegin(NoLogger):
    def __init__(self, run):
        raise RuntimeError("quota")


def nothing(run):
    """A target that forgets to return its logger."""


def test_a_logger_that_fails_is_said_once_and_the_others_go_on(path, capsys):
    logger = Loggers(Failing(), CsvLogger(Run(path.parent)))
    for step in (10, 20):
        logger.log_metrics({"a": 1.0}, step=step)
    logger.close()
    assert len(table(path)) == 3
    said = capsys.readouterr().err
    assert said == "Failing failed and the run goes on: log_metrics: RuntimeError: no such host\n"


@pytest.mark.parametrize("name", ["Failing", "CannotBegin"])
def test_a_training_outlives_its_logger(name, tmp_path):
    target = f"logger._target_=tests.test_loggers.{name}"
    result = forestrl(
        *("train", "experiment=smoke", "logger=none", target, f"hydra.run.dir={tmp_path}"),
        *("total_frames=256", "eval.every=0"),
    )
    assert result.status == 0 and "failed and the run goes on" in result.err
    assert len(rows(tmp_path / "metrics.csv")) == 1


def test_a_target_that_gives_no_logger_is_refused_in_one_line(tmp_path):
    target = "logger._target_=tests.test_loggers.nothing"
    folder = f"hydra.run.dir={tmp_path}/run"
    result = forestrl("train", "experiment=smoke", "logger=none", target, folder)
    assert result.status == 1
    assert "tests.test_loggers.nothing gives None: a logger has log_metrics" in result.err


def test_csv_writes_later_what_a_full_disk_did_not_take(path, monkeypatch):
    logger = CsvLogger(Run(path.parent))
    logger.log_metrics({"a": 1.0}, step=10)
    path.chmod(0o644)
    path.rename(path.with_name("away"))
    path.mkdir()  # nothing can be written here
    with pytest.raises(OSError):
        logger.log_metrics({"a": 2.0}, step=20)
    path.rmdir()
    logger.log_metrics({"a": 3.0}, step=30)
    assert table(path) == [["frames", "a"], ["10", "1"], ["20", "2"], ["30", "3"]]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"WANDB_MODE": "online"}, "WANDB_MODE=online needs a login"),
        (
            {"WANDB_API_KEY": "0" * 40, "WANDB_BASE_URL": "http://127.0.0.1:9"},
            "http://127.0.0.1:9 does not answer",
        ),
    ],
)
def test_wandb_without_login_or_network_says_one_line_and_is_offline(
    settings, said, tmp_path, monkeypatch, capsys
):
    for name in ("WANDB_API_KEY", "WANDB_MODE", "WANDB_BASE_URL"):
        monkeypatch.delenv(name, raising=False)
    for name, value in {**settings, "NETRC": str(tmp_path / "none"), "WANDB_SILENT": "1"}.items():
        monkeypatch.setenv(name, value)
    logger = WandbLogger(Run(tmp_path))
    logger.log_metrics({"a": 1.0}, step=1)
    logger.close()
    assert capsys.readouterr().err.startswith(f"wandb: {said}")
    assert list(tmp_path.glob("wandb/offline-run-*"))


def test_wandb_history_of_a_training_that_goes_on_offline_is_one(tmp_path, monkeypatch):
    monkeypatch.setenv("WANDB_MODE", "offline")
    monkeypatch.setenv("WANDB_SILENT", "true")
    run = train(tmp_path, "logger=wandb", "total_frames=512", "eval.every=0")
    result = forestrl("train", f"resume={run}", "total_frames=1024")
    assert result.status == 0, result.err
    folders = sorted(run.glob("wandb/offline-run-*"), key=lambda path: path.stat().st_mtime)
    assert len({path.name.rpartition("-")[2] for path in folders}) == 1
    (one,) = {path.name for folder in folders for path in folder.glob("run-*.wandb")}
    history = []
    for folder in folders:
        log = folder / one
        command = [sys.executable, "-m", "wandb", "leet", "inspect", "--json", str(log)]
        found = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        history += of_type([json.loads(line) for line in found.splitlines()], "history")
    assert [record["item"]["frames"] for record in history] == [256, 512, 768, 1024]


def test_tensorboard_of_a_training_that_goes_on_has_each_point_once(tmp_path):
    logger = TensorboardLogger(Run(tmp_path))
    for step in (10, 20, 30):
        logger.log_metrics({"a": 1.0}, step=step)
    logger.close()
    logger = TensorboardLogger(Run(tmp_path, frames=20))
    logger.log_metrics({"a": 2.0}, step=30)
    logger.close()
    events = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    assert [(event.step, event.value) for event in events.Scalars("a")] == [
        (10, 1.0),
        (20, 1.0),
        (30, 2.0),
    ]
