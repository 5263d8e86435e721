"""Completion in a real bash."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A home with ``forestrl`` on the path and the completion installed twice."""
    home = tmp_path_factory.mktemp("home")
    (home / ".bashrc").write_text("# what was there before\n")
    program = home / "forestrl"
    program.write_text(
        f"#!{sys.executable}\nimport sys\nsys.path[0] = {str(ROOT)!r}\n"
        "from forestrl.cli import main\nmain()\n"
    )
    program.chmod(0o755)
    for _ in range(2):
        subprocess.run([program, "--install-completion"], env=environment(home), check=True)
    return home


def environment(home):
    return os.environ | {"HOME": str(home), "PATH": f"{home}:{os.environ['PATH']}"}


def completed(line, home):
    """What bash offers for a line."""
    script = 'source ~/.bashrc; COMP_LINE="$1"; COMP_POINT=${#1}; _forestrl; echo "${COMPREPLY[@]}"'
    words = ["bash", "-c", script, "bash", line]
    result = subprocess.run(words, env=environment(home), cwd=home, capture_output=True, text=True)
    assert result.stderr == ""
    return result.stdout.split()


@pytest.mark.parametrize(
    ("line", "offers"),
    [
        ("forestrl ", ["train", "eval", "render", "figures", "bench", "collisions"]),
        ("forestrl re", ["render"]),
        ("forestrl train env.s", ["env.seed=", "env.size="]),
        ("forestrl eval policy=in", ["information_gain", "information_gain_tuned"]),
        ("forestrl eval policy=random policy.f", ["policy.feasible_only="]),
        ("forestrl nonsense env.s", []),
    ],
)
def test_commands_groups_and_settings_are_completed(line, offers, home):
    assert completed(line, home) == offers


def test_the_startup_file_is_extended_once(home):
    before, line = (home / ".bashrc").read_text().splitlines()
    assert before == "# what was there before" and line.startswith("source ")
