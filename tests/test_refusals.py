"""What is not allowed is said in one line, with its name, its value and what is."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from forestrl.policies.files import POLICY_FILE, Described, load_policy, save_policy
from tests.commands import SHORT, forestrl, train

ROOT = Path(__file__).resolve().parents[1]
ARENAS = ("env=tiny", "graph.max_frontiers=64", "eval.steps=30")
TRAIN = [
    ("nope=1", "there is no setting nope$"),
    ("env.sizze=50", r"there is no setting env.sizze: did you mean env.size\?$"),
    ("+eval.arena=1", r"there is no setting eval.arena: did you mean eval.arenas\?$"),
    ("+total_frame=1", r"there is no setting total_frame: did you mean total_frames\?$"),
    ("+reward.betta=1", "reward.betta is not a setting of .*Reward: did you mean reward.beta"),
    ("env.size=2", "env.size=2 .*3"),
    ("env.size=large", "env.size=large .*a whole number"),
    ("env.size=14.5", "env.size=14.5 .*a whole number"),
    ("env.n_trees=-1", "env.n_trees=-1 .*0"),
    ("env.n_trees=100000", "env.n_trees=100000 .*no free cell .*14 x 14"),
    ("env.tree_radius=[3,1]", r"env.tree_radius=\[3,1\] .*smallest, largest"),
    ("env.tree_radius=3", "env.tree_radius=3 .*a list"),
    ("env.tree_radius={a:1}", "env.tree_radius={a:1}: .*ListConfig"),
    ("env.lidar_range={a:1}", "env.lidar_range={'a': 1} .*a number"),
    ("env._target_=null", "env._target_=null .*a class or function"),
    ("env.num_envs=null", "env.num_envs=null .*a whole number"),
    ("env.num_envs=3", "env.num_envs=3 .*divide algo.frames_per_batch=256"),
    ("graph.window=4", "graph.window=4 .*odd"),
    ("graph.window=-1", "graph.window=-1 .*odd"),
    ("reward.beta=-1", "reward.beta=-1 .*0"),
    ("reward.beta=nan", "reward.beta=nan .*a number"),
    ("env.coverage_goal=0", r"env.coverage_goal=0 "),
    ("env.coverage_goal=1.5", r"env.coverage_goal=1.5 .*1"),
    ("model.kernel=cuda", "kernel.*fused.*pyg"),
    ("algo.num_minibatches=7", "algo.num_minibatches=7 .*divide algo.frames_per_batch=256"),
    ("algo.entropy_coeff=-1", "algo.entropy_coeff=-1 .*a number from 0 to 1000$"),
    ("algo.gamma=1.1", "algo.gamma=1.1 .*a number from 0 to 1$"),
    ("algo.lr=0", "algo.lr=0 .*a number more than 0 and at most 1$"),
    ("total_frames=0", "total_frames=0 .*from 1 to 1_000_000_000$"),
    ("total_frames=null", "total_frames=null .*a whole number"),
    ("episode_steps=0", "episode_steps=0 .*from 1 to 1_000_000_000$"),
    ("eval.steps=0", "eval.steps=0 .*from 1 to 1_000_000_000$"),
    ("eval=3", "eval=3 .*a group with settings of its own$"),
    ("~eval", "there is no eval, which is needed$"),
    ("~eval.steps", "there is no eval.steps, which is needed$"),
    ("threads=0", "threads=0 .*from 1 to 256$"),
    ("threads=10000", "threads=10000 .*from 1 to 256$"),
    ("seed=-1", r"seed=-1 .*from 0 to 2\^63 - 1$"),
    ("seed=99999999999999999999", "seed=99999999999999999999 .*a whole number from 0"),
    ("debug=maybe", "debug=maybe .*true or false$"),
    ("device=null", "device=null .*text$"),
    ("device=cuda:7", "device=cuda:7 is not there.*cpu"),
    ("device=toaster", "device=toaster is not there.*cpu"),
    ("logger=nope", "logger/nope.*csv none tensorboard wandb$"),
    ("logger.name=other", "there is no setting logger.name"),
    ("resume=/usr", "resume=/usr is not a run folder"),
    ("resume=0", "resume=0 is not a run folder"),
]
OTHERS = [
    ("eval policy.name=random", "policy.name is a label: choose with policy=random$"),
    ("eval policy=nearest_frontier checkpoint=nothere", "checkpoint=nothere .*reads none$"),
    ("render policy=random checkpoint=nothere", "checkpoint=nothere .*reads none$"),
    ("eval eval.first=-1", "eval.first=-1 .*from 0 to 1_000_000_000$"),
    ("eval seed=1", r"seed is not read by this command: did you mean eval.seed\?$"),
    ("eval reward.beta=1", "reward.beta is not read by this command"),
    ("eval reward=coverage", "reward is not read by this command"),
    ("render render.arena=-1", "render.arena=-1 .*from 0 to 1_000_000_000$"),
    ("eval policy=cost policy.variant=other", "policy.variant=other .*published or corrected$"),
    ("eval policy=information_gain policy.window=4", "policy.window=4 .*an odd whole number"),
    ("eval policy=random policy.feasible_only=1", "policy.feasible_only=1 .*true or false$"),
    (
        "eval policy=learned policy.deterministic=often",
        "policy.deterministic=often .*true or false",
    ),
    ("collisions collisions.sizes=[]", r"collisions.sizes=\[\] .*a list of one or more"),
    (
        "collisions collisions.densities=[-1]",
        r"collisions.densities=\[-1\] .*from 0 to 1_000_000_000$",
    ),
    ("collisions env.size=20", r"env.size is not read .*: did you mean collisions.sizes\?$"),
    ("collisions policy=random", "policy=random is not allowed"),
    ("figures results=null", "results=null .*a path$"),
    ("figures debug=1", "debug=1 .*true or false$"),
    ("bench bench.seconds=0", "bench.seconds=0 .*more than 0 and at most 3600$"),
    ("bench bench.sizes=[2]", r"bench.sizes=\[2\] .*from 3 to 1000"),
]


def refusal(result):
    """The one line that a refused command says."""
    assert result.status == 1
    (line,) = result.err.splitlines()
    return line


@pytest.mark.parametrize(("setting", "expected"), TRAIN)
def test_train_refuses_in_one_line(setting, expected, tmp_path):
    result = forestrl("train", "experiment=smoke", setting, f"hydra.run.dir={tmp_path}")
    line = refusal(result)
    assert line.startswith("forestrl train: ")
    assert re.search(expected, line)


@pytest.mark.parametrize(("words", "expected"), OTHERS)
def test_other_commands_refuse_in_one_line(words, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert re.search(expected, refusal(forestrl(*words.split())))
    assert list(tmp_path.iterdir()) == []


def test_every_job_of_a_sweep_is_refused_by_the_same_words(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = forestrl("train", "-m", "env.n_trees=-1,-2", "env=tiny")
    assert result.status == 1
    assert re.search(r"env.n_trees=-2 is not allowed", result.err.splitlines()[-1])
    assert "env.n_trees=-1 is not allowed" in result.err


MINE = """
class Bold:
    def __init__(self, price: float, shaped: bool = True):
        raise RuntimeError("never called" if price < 0 else "broken inside")
"""


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A folder with a reward of one's own, found as Hydra's search path has it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "my_refused_module.py").write_text(MINE)
    node = tmp_path / "my_conf/reward/bold.yaml"
    node.parent.mkdir(parents=True)

    def write(text):
        node.write_text(f"_target_: my_refused_module.Bold\n{text}\n")
        return "env=tiny", "reward=bold"

    return write


@pytest.mark.parametrize(
    "where", ["hydra.searchpath=[file://{}/my_conf]", "--config-dir={}/my_conf"]
)
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("price: high", "reward.price=high is not allowed: it must be a number$"),
        ("price: [1]", r"reward.price=\[1\] is not allowed: it must be a number$"),
        ("{price: 1, shaped: 1}", "reward.shaped=1 is not allowed: it must be true or false$"),
        (
            "{price: 1, prise: 1}",
            "reward.prise is not a setting of my_.*: did you mean reward.price",
        ),
        ("shaped: true", "my_refused_module.Bold cannot be made: TypeError: .*price"),
        (
            "price: 1",
            "reward: my_refused_module.Bold cannot be made: RuntimeError: broken inside; debug",
        ),
        ("price: ${nothing}", "nothing.*not found.*reward.price"),
    ],
)
def test_a_node_of_ones_own_is_checked_by_its_signature(text, expected, where, mine, tmp_path):
    line = text if text[0] != "{" else text[1:-1].replace(", ", "\n")
    words = mine(line)
    assert re.search(expected, refusal(forestrl("train", where.format(tmp_path), *words)))


@pytest.mark.parametrize("module", ["train", "forestrl"])
def test_modules_of_ones_own_are_found_in_the_folder_one_is_in(module, mine, tmp_path):
    """By ``python -m`` and by the console script, which has no folder on its path but its own."""
    words = mine("price: 1")
    program = ["-m", "forestrl.train"]
    if module == "forestrl":
        script = tmp_path / "bin/forestrl"
        script.parent.mkdir()
        script.write_text("from forestrl.cli import main\nmain()\n")
        program = [script, "train"]
    run = [sys.executable, *program, "--config-dir", "my_conf", *words]
    environment = {"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "HOME": str(tmp_path)}
    result = subprocess.run(run, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert "my_refused_module.Bold cannot be made: RuntimeError: broken inside" in result.stderr


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return train(tmp_path_factory.mktemp("run") / "1e3", *SHORT)


@pytest.fixture
def policy_file(run, tmp_path):
    policy = load_policy(run)
    graph = Described("exploration_graph", {"window": 9})
    save_policy(tmp_path / POLICY_FILE, replace(policy, observation=graph))
    return tmp_path / POLICY_FILE


@pytest.mark.parametrize("name", ["1e3", "0", "true", "007", "1_0", ".5"])
def test_a_folder_may_be_called_like_a_number(name, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).symlink_to(run)
    result = forestrl("eval", *ARENAS, "eval.arenas=1", f"checkpoint={name}", "hydra.run.dir=2e5")
    assert result.status == 0, result.err
    assert (tmp_path / "2e5/summary.json").is_file()


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
    words = ("eval", *ARENAS, f"checkpoint={policy_file}", "eval.arenas=1")
    result = forestrl(*words, f"hydra.run.dir={tmp_path}/out")
    assert result.status == 0, result.err


def test_an_output_folder_that_cannot_be_written_is_said_in_one_line(tmp_path):
    (tmp_path / "file").touch()
    folder = tmp_path / "file/run"
    assert str(folder) in refusal(forestrl("train", f"hydra.run.dir={folder}"))


GREEDY = """
import torch
from forestrl.planners import RandomWalk

class Greedy(RandomWalk):
    def forward(self, tensordict):
        torch.empty(2**60)
"""


def test_memory_that_is_not_there_is_said_in_one_line(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "my_greedy_module.py").write_text(GREEDY)
    words = ("env=tiny", "policy=random", "policy._target_=my_greedy_module.Greedy")
    line = refusal(forestrl("eval", *words, f"hydra.run.dir={tmp_path}/out"))
    assert "forestrl eval: not enough memory for arenas so large or many: " in line


def test_debug_lets_the_error_through(tmp_path):
    with pytest.raises(ValueError, match=r"env\.size=large"):
        forestrl("train", "env.size=large", "debug=true", f"hydra.run.dir={tmp_path}")


def test_the_process_ends_with_the_status_and_only_debug_prints_a_traceback(tmp_path):
    for settings, traced in ((["env.size=2"], False), (["env.size=2", "debug=true"], True)):
        words = [sys.executable, "-m", "forestrl.train", f"hydra.run.dir={tmp_path}", *settings]
        result = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
        assert result.returncode == 1
        assert ("Traceback (most recent call last)" in result.stderr) is traced
        assert traced or result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "library", "extra"),
    [
        ("figures", "pandas", "report"),
        ("figures", "tabulate", "report"),
        ("train experiment=linear algo.generations=1 eval.arenas=1", "cma", "search"),
        ("dashboard", "wandb_workspaces", "dashboard"),
    ],
)
def test_a_library_of_an_extra_that_is_missing_is_said_in_one_line(words, library, extra, tmp_path):
    code = (
        f"import sys; sys.modules[{library!r}] = None; "
        f"sys.argv = ['forestrl', *{words.split()!r}]; "
        "from forestrl.cli import main; main()"
    )
    run = [sys.executable, "-c", code]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    result = subprocess.run(run, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert result.returncode == 1
    assert result.stderr.splitlines()[-1].endswith(f'this needs pip install "forestrl[{extra}]"')
    assert "Traceback" not in result.stderr
    assert not list(tmp_path.glob("*.log"))
