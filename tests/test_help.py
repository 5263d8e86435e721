"""``--help``: every setting with its meaning and range, at once and without what computes."""

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from forestrl.cli import COMMANDS
from forestrl.config import CONF_DIR, followed, is_unread, kinds_of, leaves
from forestrl.help import settings
from forestrl.settings import describe
from tests.commands import compose, forestrl

ROOT = Path(__file__).resolve().parents[1]
HEAVY = {"torch", "numba", "numpy", "scipy", "matplotlib", "wandb"}


def helped(*words):
    result = forestrl(*words, "--help")
    assert (result.status, result.err) == (0, ""), result.err
    return result.out


@pytest.mark.parametrize(
    ("words", "row"),
    [
        ("train", "total_frames=400000 training timesteps (Table III), over all arenas [a whole"),
        ("train", "algo.gamma=0.99 discount factor [a number from 0 to 1]"),
        ("train", "eval.every=40000 frames between evaluations; 0: never [a whole number"),
        ("train", "model.kernel=fused fused: compiled for the CPU | pyg: PyTorch Geometric's"),
        (
            "eval",
            "checkpoint=null a run folder or a policy file; null: the released policy [a path",
        ),
        (
            "eval policy=cost",
            "policy.variant=published published, and how it gets stuck | corrected",
        ),
        ("eval policy=cost", "policy=cost Explore-Bench's cost-based planner: the nearest cluster"),
        ("collisions", "collisions.sizes=[20,50,75] arena sides, cells [a list of one or more"),
        ("train env=forest75", "env.size=75 h, arena side, cells"),
        ("train experiment=smoke", "total_frames=1024 training timesteps"),
    ],
)
def test_help_says_value_meaning_and_range(words, row):
    assert row in " ".join(helped(*words.split()).split())


def test_options_may_stand_anywhere():
    assert "env.size=75 " in forestrl("train", "--help", "env=forest75").out
    assert "size: 75" in forestrl("train", "env=forest75", "--cfg", "job", "seed=1").out


def test_help_lists_the_groups_that_the_command_reads_and_no_others():
    groups = {
        words: set(re.findall(r"^(\w+)=", helped(*words.split()), re.MULTILINE))
        for words in ("train", "eval", "collisions")
    }
    world = {"env", "safety", "graph", "model"}
    assert groups["train"] == world | {"reward", "algo", "logger", "experiment", "ablation"}
    assert groups["eval"] == world | {"policy", "logger"}
    assert groups["collisions"] == world - {"safety"} | {"policy"}


def test_help_knows_what_a_user_adds(tmp_path, monkeypatch):
    """A folder of one's own, for a class of one's own that cannot even be imported."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_conf/reward").mkdir(parents=True)
    (tmp_path / "my_conf/reward/bold.yaml").write_text(
        "# A reward for the bold.\n_target_: my_help_module.Bold\nprice: 2.0  # for each step\n"
    )
    (tmp_path / "my_help_module.py").write_text(
        "import nowhere\nfrom typing import Annotated\nfrom forestrl.settings import Range\n"
        "class Bold:\n    def __init__(self, price: Annotated[float, Range(0)]): ...\n"
    )
    text = " ".join(helped("train", "--config-dir", "my_conf", "reward=bold").split())
    assert "reward=bold A reward for the bold. Others: coverage, frontier_potential." in text
    assert "reward.price=2.0 for each step [a number of at least 0]" in text


@pytest.mark.parametrize("name", COMMANDS)
def test_every_setting_of_every_command_has_a_meaning_and_a_kind(name):
    declared = import_module(f"forestrl.{name}").Settings
    cfg = compose(name, return_hydra_config=True)
    rows = {row.name: row for row in settings(cfg, declared, [Path(CONF_DIR)])}
    wanted = {
        name
        for name, raw in leaves(cfg).items()
        if "_target_" not in name and not is_unread(declared, name) and name != "policy.name"
    }
    unlisted = wanted - rows.keys()
    assert all(followed(leaves(cfg)[name]) for name in unlisted), unlisted
    assert [row.name for row in rows.values() if not row.meaning or not row.allowed] == []
    assert all(describe(kinds_of(cfg, declared)[name]) for name in rows)


@pytest.mark.parametrize(
    ("words", "status"),
    [
        ("{} --help", 0),
        ("{} --cfg job", 0),
        ("{} debug=maybe", 1),
        ("{} nonsense=1", 1),
    ],
)
@pytest.mark.parametrize("name", COMMANDS)
def test_help_configuration_and_refusals_need_nothing_heavy(name, words, status, tmp_path):
    code = f"""
import atexit, sys
atexit.register(lambda: print("heavy:", *{HEAVY} & sys.modules.keys()))
sys.path.insert(0, {str(ROOT)!r})
sys.argv = ["forestrl", *{words.format(name).split()!r}]
from forestrl.cli import main
main()
"""
    run = [sys.executable, "-c", code]
    result = subprocess.run(run, capture_output=True, text=True, cwd=tmp_path)
    assert result.returncode == status, result.stderr
    assert result.stdout.splitlines()[-1] == "heavy:"
