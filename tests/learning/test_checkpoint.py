"""A training that stops and goes on is the training that did not stop, bit for bit."""

import pytest
import torch

from forestrl.learning.checkpoint import TRAINING_FILE, load_training
from forestrl.policies.files import load_policy
from tests.commands import forestrl, rows, train

HALF, WHOLE = "total_frames=512", "total_frames=1024"


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    return train(tmp_path_factory.mktemp("unbroken"), WHOLE)


@pytest.fixture(scope="module")
def resumed(tmp_path_factory):
    folder = train(tmp_path_factory.mktemp("resumed"), HALF)
    assert len(rows(folder / "metrics.csv")) == 2
    torch.manual_seed(99)  # another program's randomness in between
    result = forestrl("train", f"resume={folder}", WHOLE, f"hydra.run.dir={folder}/again")
    assert result.status == 0, result.err
    return folder


def test_metrics_are_the_same(unbroken, resumed):
    expected = rows(unbroken / "metrics.csv")
    assert [row["frames"] for row in expected] == ["256", "512", "768", "1024"]
    assert rows(resumed / "metrics.csv") == expected


@pytest.mark.parametrize("alias", ["latest", "best"])
def test_weights_are_the_same(alias, unbroken, resumed):
    ours, theirs = (load_policy(f / "checkpoints" / alias) for f in (resumed, unbroken))
    assert ours.training["frames"] == theirs.training["frames"]
    assert ours.weights.keys() == theirs.weights.keys()
    for name, weight in ours.weights.items():
        assert torch.equal(weight, theirs.weights[name]), name


def test_everything_else_is_the_same(unbroken, resumed):
    ours, theirs = (load_training(folder / "checkpoints/latest") for folder in (resumed, unbroken))
    assert ours.keys() == theirs.keys()
    assert torch.equal(ours["rng"], theirs["rng"])
    ours, theirs = ours["collector"], theirs["collector"]
    assert ours["frames"] == theirs["frames"] == 1024
    assert torch.equal(ours["generator"], theirs["generator"])
    for key, value in ours["arenas"].items():
        if key.startswith("collector/"):  # numbers of the trajectories, which nothing reads
            continue
        assert torch.equal(value, theirs["arenas"][key]), key


def test_a_finished_run_has_nothing_left_to_do(resumed):
    before = rows(resumed / "metrics.csv")
    result = forestrl("train", f"resume={resumed}", f"hydra.run.dir={resumed}/again")
    assert result.status == 0, result.err
    assert rows(resumed / "metrics.csv") == before


@pytest.fixture
def run(tmp_path):
    return train(tmp_path / "run", "total_frames=256", "eval.every=0", "checkpoint_every=256")


def refusal(folder, *arguments):
    result = forestrl("train", f"resume={folder}", f"hydra.run.dir={folder}/again", *arguments)
    assert result.status == 1
    (line,) = result.err.splitlines()
    return line


def test_damaged_training_file_is_refused(run):
    path = run / "checkpoints/latest" / TRAINING_FILE
    path.write_bytes(path.read_bytes()[:1000])
    line = refusal(run)
    assert str(path) in line and "damaged" in line


def test_a_run_without_a_checkpoint_begins_anew(run):
    before = rows(run / "metrics.csv")
    (run / "checkpoints/latest" / TRAINING_FILE).unlink()
    assert forestrl("train", f"resume={run}").status == 0
    assert rows(run / "metrics.csv") == before


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ("model.hidden=8", "other settings"),
        ("env.num_envs=2", "leave env.size, env.num_envs"),
        ("graph.max_frontiers=32", "leave env.size, env.num_envs and the observation"),
    ],
)
def test_another_model_number_of_arenas_or_observation_is_refused(change, why, run):
    assert why in refusal(run, change)


@pytest.mark.parametrize("place", [0.01, 0.4, 0.8])
def test_a_flipped_bit_is_noticed(place, run):
    path = run / "checkpoints/latest" / TRAINING_FILE
    data = bytearray(path.read_bytes())
    data[int(place * len(data))] ^= 1
    path.write_bytes(data)
    line = refusal(run)
    assert str(path) in line and "damaged" in line


def test_training_file_runs_no_code(run):
    """It is read with ``weights_only``: an object of any other class is refused."""
    torch.save({"actor": Exception}, run / "checkpoints/latest" / TRAINING_FILE)
    assert "damaged" in refusal(run)
