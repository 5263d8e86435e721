"""What the documentation says is run: its modules, its YAML files and its commands."""

from __future__ import annotations

import csv
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands import train

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```(python|yaml|bash)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page):
    return BLOCK.findall((ROOT / "docs" / page).read_text())


def write_files(page, folder):
    """Writes the blocks that begin with a file's name, one after the other into the same file."""
    for kind, text in blocks(page):
        if kind == "bash":
            continue
        name, _, rest = text.removeprefix("# ").partition("\n")
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a") as file:
            file.write(rest)


def run(words, folder):
    env = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "WANDB_MODE": "offline"}
    return subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True)


@pytest.mark.slow
def test_the_page_on_extending_runs_as_it_stands(tmp_path):
    """A foreign world, observation, network, reward, planner, logger and sweep, from outside."""
    write_files("extend.md", tmp_path)
    commands = [
        line for kind, text in blocks("extend.md") if kind == "bash" for line in text.splitlines()
    ]
    assert len(commands) >= 8
    for line in commands:
        program, command, *rest = shlex.split(line)
        assert program == "forestrl"
        words = [sys.executable, "-m", f"forestrl.{command}", *rest]
        if command == "eval" and "eval.steps=200" not in rest:
            words.append("eval.steps=50")
        done = run(words, tmp_path)
        assert done.returncode == 0, f"{line}\n{done.stderr}"
    assert run([sys.executable, "use.py"], tmp_path).returncode == 0
    head = (tmp_path / "hurried/metrics.csv").read_text().splitlines()[0]
    assert "reward/price" in head and "reward/potential" not in head
    frames = [line.split(",")[0] for line in (tmp_path / "my_run/metrics.csv").read_text().split()]
    assert frames[1:] == [str(256 * n) for n in range(1, 9)]
    assert (tmp_path / "logged/metrics.jsonl").read_text().count("frames") == 4
    assert (tmp_path / "multirun/mine/table.md").is_file()
    assert list(tmp_path.glob("outputs/render/*/episode.gif"))


@pytest.mark.slow
def test_the_page_on_looking_at_episodes_runs_as_it_stands(tmp_path):
    write_files("show.md", tmp_path)
    (text,) = (text for kind, text in blocks("show.md") if kind == "bash")
    lines = [shlex.split(line, comments=True) for line in text.splitlines()]
    for i, (_, command, *rest) in enumerate(lines):
        words = [sys.executable, "-m", f"forestrl.{command}", *rest, f"hydra.run.dir={i}"]
        done = run([*words, "show.steps=20"], tmp_path)
        assert done.returncode == 0, done.stderr
        assert (tmp_path / str(i) / "episode.html").is_file()
    assert run([sys.executable, "look.py"], tmp_path).returncode == 0
    assert (tmp_path / "look.html").stat().st_size > 10_000


def explained():
    """The metrics that the page names, with the levels written out."""
    names = re.findall(
        r"^\| `([a-z_/A-Z0-9]+)`", (ROOT / "docs/metrics.md").read_text(), re.MULTILINE
    )
    levels = {"rollout/steps_to_N": (80, 90, 98), "eval/steps_to_N": (80, 95, 98)}
    for name in names:
        if name in levels:
            yield from (name.replace("N", str(level)) for level in levels[name])
        else:
            yield name


def test_every_metric_of_a_training_is_explained_and_no_other(tmp_path):
    run = train(tmp_path)
    with (run / "metrics.csv").open(newline="") as file:
        logged = next(csv.reader(file))
    assert set(explained()) - {"reward/mean"} == set(logged)
    assert "reward/mean" in set(explained())  # of other rewards; tests/learning/test_metrics.py
