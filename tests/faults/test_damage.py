"""Damaged files, full disks and broken numbers: said in a line, and gone on from."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from forestrl.arrays import load_arrays, save_arrays
from forestrl.evaluation.parts import Parts
from forestrl.learning.checkpoint import BEFORE_FILE, TRAINING_FILE
from forestrl.learning.ppo import PPO
from forestrl.loggers.csv import read_rows
from forestrl.storage import atomic_write
from tests.commands import SHORT, forestrl, rows, train

ROOT = Path(__file__).resolve().parents[2]
EVERY = ("checkpoint_every=256", "eval.every=0")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return train(tmp_path_factory.mktemp("whole"), *EVERY)


@pytest.fixture
def half(tmp_path):
    return train(tmp_path / "run", *EVERY, "total_frames=512")


def flip(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize(
    "damage",
    [
        flip,
        lambda path: path.write_bytes(path.read_bytes()[:1000]),
        lambda path: path.write_bytes(b""),
        lambda path: torch.save({"actor": Exception}, path),
    ],
    ids=["flipped", "torn", "empty", "foreign"],
)
def test_a_damaged_checkpoint_gives_way_to_the_one_before(damage, half, whole):
    damage(half / "checkpoints/latest" / TRAINING_FILE)
    result = forestrl("train", f"resume={half}", "total_frames=1024")
    assert result.status == 0, result.err
    said = result.err.splitlines()[0]
    assert "damaged" in said and said.endswith(f"going on from the one before, {BEFORE_FILE}")
    assert rows(half / "metrics.csv") == rows(whole / "metrics.csv")


def test_a_checkpoint_of_something_else_is_refused_in_one_line(half):
    for name in (TRAINING_FILE, BEFORE_FILE):
        torch.save({"actor": {}, "weights": torch.zeros(3)}, half / "checkpoints/latest" / name)
    result = forestrl("train", f"resume={half}", "total_frames=1024")
    assert result.status == 1 and len(result.err.splitlines()) == 1
    assert "other settings" in result.err or "not of a training like this one" in result.err


@pytest.mark.parametrize("line", [b"256,0.5", b"\0\0\0\0\n", b"\n", b"256,1,2,3,4\n", b"256,x,1\n"])
def test_a_damaged_row_is_left_out_and_counted(line, tmp_path):
    path = tmp_path / "metrics.csv"
    path.write_bytes(b"frames,a,b\n128,1,\n" + line)
    columns, found, words = read_rows(path)
    assert columns == ["frames", "a", "b"] and found == [{"frames": "128", "a": "1", "b": ""}]
    assert words == "1 row, which was"


def test_a_training_goes_on_over_a_torn_row(half, whole):
    with (half / "metrics.csv").open("ab") as file:
        file.write(b"768,0.1,0.")
    result = forestrl("train", f"resume={half}", "total_frames=1024")
    assert result.status == 0 and "metrics.csv: left out 1 row, which was damaged" in result.err
    assert rows(half / "metrics.csv") == rows(whole / "metrics.csv")


def test_what_a_killed_writer_left_is_cleared(half):
    part = half / "checkpoints/latest/.training.pt.0123abcd.part"
    part.touch()
    assert forestrl("train", f"resume={half}").status == 0
    assert not part.exists()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"x" * 300])
def test_damaged_arrays_count_as_missing(content, tmp_path):
    path = tmp_path / "0-3.npz"
    save_arrays(path, {"a": torch.arange(1000).numpy()})
    whole = path.read_bytes()
    assert load_arrays(path, ["a"])["a"].tolist() == list(range(1000))
    for damaged in (content, whole[:-30], whole[:200] + b"\0" + whole[201:]):
        path.write_bytes(damaged)
        assert load_arrays(path, ["a"]) is None


def test_parts_whose_settings_cannot_be_read_are_measured_again(tmp_path):
    Parts(tmp_path, {"policy": "random"})
    (tmp_path / "0-3.npz").write_bytes(b"of whatever")
    (tmp_path / "settings.json").write_bytes(b'{"pol')
    Parts(tmp_path, {"policy": "other"})
    assert [path.name for path in tmp_path.iterdir()] == ["settings.json"]
    assert json.loads((tmp_path / "settings.json").read_text()) == {"policy": "other"}


def test_the_file_that_stood_there_is_kept_if_asked(tmp_path):
    atomic_write(tmp_path / "a", "1", before=tmp_path / "b")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    atomic_write(tmp_path / "a", "2", before=tmp_path / "b")
    assert ((tmp_path / "a").read_text(), (tmp_path / "b").read_text()) == ("2", "1")


def test_a_number_that_is_not_finite_stops_the_training_before_it_is_learned(
    half, whole, monkeypatch
):
    """The third update's reward holds one; the metric, the batch and the checkpoint are there."""
    estimate = PPO.estimate_advantage

    def broken(self, batch):
        batch["next", "reward"][0, 0] = float("nan")
        estimate(self, batch)

    with monkeypatch.context() as patch:
        patch.setattr(PPO, "estimate_advantage", broken)
        result = forestrl("train", f"resume={half}", "total_frames=1024")
    assert result.status == 1
    assert "reward is nan in the update after frame 512" in result.err.splitlines()[-1]
    batch = torch.load(half / "not_finite.pt", weights_only=True)
    assert batch["next/reward"].isnan().sum() == 1 and batch["action"].numel() == 256
    assert forestrl("train", f"resume={half}").status == 0
    assert rows(half / "metrics.csv") == rows(whole / "metrics.csv")


@pytest.mark.parametrize(
    ("key", "metric"), [("advantage", "loss/objective"), ("value_target", "loss/critic")]
)
def test_a_loss_that_is_not_finite_is_named(key, metric, tmp_path, monkeypatch):
    step = PPO.step

    def broken(self, minibatch):
        minibatch[key][0] = float("inf")
        return step(self, minibatch)

    monkeypatch.setattr(PPO, "step", broken)
    result = forestrl("train", "experiment=smoke", f"hydra.run.dir={tmp_path}", *SHORT)
    assert result.status == 1
    assert f"{metric} is " in result.err.splitlines()[-1]
    assert "resume=" in result.err.splitlines()[-1]


FULL = """
import resource, sys
from forestrl.cli import main
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
main()
"""


def in_a_process(script, *words, folder, **settings):
    environment = os.environ | {
        "PYTHONPATH": str(ROOT),
        "NUMBA_CACHE_DIR": os.environ.get("NUMBA_CACHE_DIR", ""),
    }
    if not environment["NUMBA_CACHE_DIR"]:
        del environment["NUMBA_CACHE_DIR"]
    return subprocess.run(
        [sys.executable, "-c", script, *words],
        cwd=folder,
        env=environment | settings.pop("env", {}),
        capture_output=True,
        text=True,
        **settings,
    )


def test_a_full_disk_does_not_end_a_training_on_the_way_and_is_no_traceback(half):
    """No file may grow beyond 60 kB, which a checkpoint does: only the last one is an error."""
    before = (half / "checkpoints/latest" / TRAINING_FILE).read_bytes()
    result = in_a_process(FULL, "train", "resume=run", "total_frames=1024", folder=half.parent)
    assert result.returncode == 1 and "Traceback" not in result.stderr
    assert "no checkpoint at frame 768: [Errno 27]" in result.stderr
    assert "File too large" in result.stderr.splitlines()[-1]
    assert (half / "checkpoints/latest" / TRAINING_FILE).read_bytes() == before
    assert [row["frames"] for row in rows(half / "metrics.csv")] == ["256", "512", "768", "1024"]


def test_a_training_needs_no_home_and_no_name_for_its_user(tmp_path):
    script = "from forestrl.cli import main; main()"
    words = ("train", "experiment=smoke", "logger=wandb", "hydra.run.dir=run", *SHORT)
    nobody = {"HOME": str(tmp_path / "none"), "NETRC": "", "WANDB_MODE": "offline"}
    result = in_a_process(script, *words, folder=tmp_path, env=nobody)
    assert result.returncode == 0, result.stderr
    assert len(rows(tmp_path / "run/metrics.csv")) == 1
