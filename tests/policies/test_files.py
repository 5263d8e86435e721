"""Policy files."""

import json

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from forestrl.policies.actor_critic import ActorCritic
from forestrl.policies.files import (
    FORMAT,
    POLICY_FILE,
    RELEASED,
    CheckpointError,
    Policy,
    find_policy,
    load_policy,
    require_same,
    save_policy,
)

MODEL = {"hidden": 16, "heads": 4, "critic_readout": "mean", "lidar_range": 5.0}


def make_policy(**changes):
    model = MODEL | changes
    return Policy(model, 7, {"frames": 1024, "seed": 3}, ActorCritic(**model).state_dict())


def refusal(action):
    with pytest.raises(CheckpointError) as caught:
        action()
    return str(caught.value)


@pytest.fixture
def file(tmp_path):
    save_policy(tmp_path / POLICY_FILE, make_policy())
    return tmp_path / POLICY_FILE


def test_a_policy_comes_back_as_it_was(tmp_path):
    policy = make_policy(hidden=8, critic_readout="concat")
    save_policy(tmp_path / "mine.safetensors", policy)
    again = load_policy(tmp_path / "mine.safetensors")
    assert (again.model, again.window, again.training) == (
        policy.model,
        policy.window,
        policy.training,
    )
    built = again.build("pyg").state_dict()
    assert built.keys() == policy.weights.keys()
    for name, weight in policy.weights.items():
        assert torch.equal(built[name], weight), name


def test_a_loaded_policy_does_not_learn(file):
    networks = load_policy(file).build()
    assert not networks.training
    assert not any(weight.requires_grad for weight in networks.parameters())


def test_a_policy_file_is_small_and_no_pickle(file):
    assert file.stat().st_size < 30_000
    data = file.read_bytes()
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    assert header["__metadata__"]["format"] == FORMAT
    assert header.keys() - {"__metadata__"} == make_policy().weights.keys()


def test_other_programs_can_read_it(file):
    with safe_open(file, framework="np") as opened:
        assert opened.get_tensor("actor.conv1.att").shape == (1, 4, 16)
        assert json.loads(opened.metadata()["model"]) == MODEL


def test_a_run_folder_means_its_best_policy_then_its_latest_then_the_one_in_it(tmp_path):
    expected = []
    for folder in ("", "checkpoints/latest", "checkpoints/best"):
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
        save_policy(tmp_path / folder / POLICY_FILE, make_policy())
        expected.append(tmp_path / folder / POLICY_FILE)
        assert find_policy(tmp_path) == expected[-1]
    assert load_policy(str(tmp_path)).window == 7


def test_a_missing_file_is_refused(tmp_path):
    text = refusal(lambda: load_policy(tmp_path / "nowhere"))
    assert f"checkpoint={tmp_path / 'nowhere'} does not exist" in text


def test_a_folder_without_a_policy_is_refused(tmp_path):
    text = refusal(lambda: load_policy(tmp_path))
    assert str(tmp_path) in text and "folder without a policy" in text and POLICY_FILE in text


@pytest.mark.parametrize("length", [0, 5, 100, -100])
def test_a_damaged_file_is_refused(length, file):
    file.write_bytes(file.read_bytes()[:length])
    assert f"checkpoint={file} cannot be read" in refusal(lambda: load_policy(file))


def test_a_pickle_is_refused(tmp_path):
    torch.save(ActorCritic().state_dict(), tmp_path / "policy.pt")
    assert "cannot be read as a policy" in refusal(lambda: load_policy(tmp_path / "policy.pt"))


@pytest.mark.parametrize("header", [None, {"format": "pt"}])
def test_another_programs_safetensors_are_refused(header, tmp_path):
    save_file({"weight": torch.zeros(3)}, tmp_path / "other.safetensors", metadata=header)
    text = refusal(lambda: load_policy(tmp_path / "other.safetensors"))
    assert "not a policy of this program" in text and FORMAT in text


@pytest.mark.parametrize("header", [{}, {"model": "{", "window": "7", "training": "{}"}])
def test_a_policy_without_a_whole_header_is_refused(header, tmp_path):
    save_file({"weight": torch.zeros(3)}, tmp_path / "x", metadata={"format": FORMAT, **header})
    assert "cannot be read as a policy" in refusal(lambda: load_policy(tmp_path / "x"))


def test_weights_of_another_shape_are_refused(tmp_path):
    policy = make_policy()
    save_policy(tmp_path / "x", Policy(MODEL | {"heads": 2}, 7, {}, policy.weights))
    assert "do not fit" in refusal(lambda: load_policy(tmp_path / "x").build())


@pytest.mark.parametrize(
    ("name", "own", "other"),
    [
        ("hidden", 16, 32),
        ("heads", 4, 1),
        ("critic_readout", "mean", "concat"),
        ("lidar_range", 5.0, 7.0),
        ("edge_lengths", True, False),
        ("window", 7, 9),
    ],
)
def test_a_policy_for_another_model_is_refused_by_the_field(name, own, other):
    text = refusal(lambda: require_same(make_policy(), {name: other}, "mine"))
    assert "checkpoint=mine" in text and f"its {name} is {own}, but {name}={other}" in text


def test_the_same_model_is_accepted():
    require_same(make_policy(), {**MODEL, "window": 7, "unknown": 1}, "mine")


def test_the_released_policy_is_described_beside_it():
    policy = load_policy(RELEASED)
    described = json.loads(RELEASED.with_suffix(".json").read_text())
    assert described == {
        "model": policy.model,
        "window": policy.window,
        "training": policy.training,
    }
    assert policy.training["frames"] >= 100_000
    assert (RELEASED.parent / "README.md").is_file()
