"""Policy files."""

import json

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from forestrl.policies.actor_critic import ActorCritic
from forestrl.policies.files import (
    POLICY_FILE,
    CheckpointError,
    Described,
    Policy,
    find_policy,
    load_policy,
    policy_bytes,
    require_same,
    save_policy,
)
from forestrl.policies.gatv2 import Critic, GATv2ActorCritic
from forestrl.released import MODELS, RELEASED

MODEL = {"hidden": 16, "heads": 4, "critic_readout": "mean", "edge_lengths": True}
GRAPH = Described("exploration_graph", {"window": 7})


def make_policy(**changes):
    settings = MODEL | changes
    torch.manual_seed(0)
    weights = GATv2ActorCritic(**settings).state_dict()
    return Policy(Described("gatv2", settings), GRAPH, {"frames": 1024, "seed": 3}, weights)


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
    assert again.model == policy.model and again.observation == policy.observation
    assert again.training == policy.training
    built = again.build(MODELS, kernel="pyg").state_dict()
    assert built.keys() == policy.weights.keys()
    for name, weight in policy.weights.items():
        assert torch.equal(built[name], weight), name


def test_a_loaded_policy_does_not_learn(file):
    networks = load_policy(file).build(MODELS)
    assert not networks.training
    assert not any(weight.requires_grad for weight in networks.parameters())


def test_a_policy_file_is_small_and_no_pickle(file):
    assert file.stat().st_size < 30_000
    data = file.read_bytes()
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    assert list(header["__metadata__"]) == ["forestrl"]
    assert header.keys() - {"__metadata__"} == make_policy().weights.keys()


def test_other_programs_can_read_it(file):
    with safe_open(file, framework="np") as opened:
        assert opened.get_tensor("actor.conv1.att").shape == (1, 4, 16)
        about = json.loads(opened.metadata()["forestrl"])
        assert about["model"] == {"name": "gatv2", "settings": MODEL} and about["format"] == 2


def test_equal_policies_have_equal_bytes():
    assert len({policy_bytes(make_policy()) for _ in range(8)}) == 1
    assert policy_bytes(make_policy()) != policy_bytes(make_policy(critic_readout="concat"))


def test_a_file_of_the_first_format_is_read(tmp_path):
    policy, path = make_policy(), tmp_path / "old.safetensors"
    model = {"hidden": 16, "heads": 4, "critic_readout": "mean", "lidar_range": 5.0}
    header = {"model": model, "window": 9, "training": {"frames": 7}}
    texts = {name: json.dumps(value) for name, value in header.items()}
    save_file(policy.weights, path, metadata={"format": "forestrl-policy-1", **texts})
    old = load_policy(path)
    assert old.observation.settings == {"window": 9} and old.training == {"frames": 7}
    assert old.build(MODELS).actor.edge_lengths


@pytest.mark.parametrize("place", [0.1, 0.3, 0.5, 0.9, 0.99])
def test_a_flipped_bit_is_noticed(place, file):
    data = bytearray(file.read_bytes())
    data[int(place * len(data))] ^= 0b100
    file.write_bytes(data)
    text = refusal(lambda: load_policy(file))
    assert f"checkpoint={file}" in text


@pytest.mark.parametrize("value", [float("nan"), float("-inf")])
def test_weights_that_are_not_finite_are_refused(value, tmp_path):
    policy = make_policy()
    policy.weights["actor.conv1.bias"][3] = value
    save_policy(tmp_path / "x", policy)
    text = refusal(lambda: load_policy(tmp_path / "x"))
    assert str(tmp_path / "x") in text and "not finite: actor.conv1.bias" in text


class Sums(torch.nn.Module):
    in_keys = (("graph", "x"),)

    def __init__(self, width=2):
        super().__init__()
        self.linear = torch.nn.Linear(8, width)

    def forward(self, x):
        return self.linear(x[..., :9, :]).sum(-1)


def test_a_models_name_is_looked_up_and_nothing_is_imported(tmp_path):
    """A file may name whatever it wants: only what the caller lists is built."""

    def mine(width=2):
        return ActorCritic(Sums(width), Critic(Sums(width)))

    weights = mine(5).state_dict()
    save_policy(tmp_path / "x", Policy(Described("os.system", {"width": 5}), GRAPH, {}, weights))
    policy = load_policy(tmp_path / "x")
    text = refusal(lambda: policy.build(MODELS))
    assert "'os.system', which is not one of gatv2, linear_score" in text and "--config-dir" in text
    assert policy.build({"os.system": mine}).actor.linear.weight.shape == (5, 8)


def test_a_run_folder_means_its_best_policy_then_its_latest_then_the_one_in_it(tmp_path):
    expected = []
    for folder in ("", "checkpoints/latest", "checkpoints/best"):
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
        save_policy(tmp_path / folder / POLICY_FILE, make_policy())
        expected.append(tmp_path / folder / POLICY_FILE)
        assert find_policy(tmp_path) == expected[-1]
    assert load_policy(str(tmp_path)).observation == GRAPH


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
    torch.save(GATv2ActorCritic().state_dict(), tmp_path / "policy.pt")
    assert "cannot be read as a policy" in refusal(lambda: load_policy(tmp_path / "policy.pt"))


@pytest.mark.parametrize("header", [None, {"format": "pt"}])
def test_another_programs_safetensors_are_refused(header, tmp_path):
    save_file({"weight": torch.zeros(3)}, tmp_path / "other.safetensors", metadata=header)
    text = refusal(lambda: load_policy(tmp_path / "other.safetensors"))
    assert "not a policy of this program" in text


HALF = {"format": "forestrl-policy-1", "model": "{", "window": "7", "training": "{}"}
BROKEN = [{"format": "forestrl-policy-1"}, HALF, {"forestrl": "{"}, {"forestrl": "[]"}]


@pytest.mark.parametrize("header", [*BROKEN, {"forestrl": '{"format": 2}'}])
def test_a_policy_without_a_whole_header_is_refused(header, tmp_path):
    save_file({"weight": torch.zeros(3)}, tmp_path / "x", metadata=header)
    assert "cannot be read as a policy" in refusal(lambda: load_policy(tmp_path / "x"))


def test_a_file_of_a_later_format_is_refused(tmp_path):
    save_file({"weight": torch.zeros(3)}, tmp_path / "x", metadata={"forestrl": '{"format": 9}'})
    assert "has format 9, this program reads 2" in refusal(lambda: load_policy(tmp_path / "x"))


def test_weights_of_another_shape_are_refused(tmp_path):
    policy = make_policy()
    described = Described("gatv2", MODEL | {"heads": 2})
    save_policy(tmp_path / "x", Policy(described, GRAPH, {}, policy.weights))
    text = refusal(lambda: load_policy(tmp_path / "x").build(MODELS))
    assert f"checkpoint={tmp_path / 'x'} does not fit its model" in text and "\n" not in text


@pytest.mark.parametrize(
    ("name", "own", "other"),
    [
        ("model.hidden", 16, 32),
        ("model.heads", 4, 1),
        ("model.critic_readout", "mean", "concat"),
        ("model.edge_lengths", True, False),
        ("graph.window", 7, 9),
    ],
)
def test_a_policy_made_with_other_settings_is_refused_by_the_setting(name, own, other):
    text = refusal(lambda: require_same(make_policy(), {name: other}))
    assert f"was made with {name}={own}, but {name}={other} was asked for" in text


def test_the_same_settings_and_those_it_says_nothing_of_are_accepted():
    require_same(make_policy(), {"model.hidden": 16, "graph.window": 7, "graph.unknown": 1})


@pytest.mark.parametrize("name", RELEASED)
def test_a_released_policy_is_described_beside_it(name):
    policy = load_policy(RELEASED[name])
    described = json.loads(RELEASED[name].with_suffix(".json").read_text())
    assert described["model"] == vars(policy.model)
    assert described["observation"] == (policy.observation and vars(policy.observation))
    assert described["training"] == policy.training
