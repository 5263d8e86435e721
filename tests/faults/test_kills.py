"""The fault script in a short form; by hand it kills fifty times."""

import subprocess
import sys
from pathlib import Path


def test_trainings_that_are_killed_and_go_on_equal_one_that_was_left_alone(tmp_path):
    """In a process of its own, as it forks."""
    script = "from pathlib import Path; from tests.faults.kills import run; run(3, Path({!r}))"
    subprocess.run(
        [sys.executable, "-c", script.format(str(tmp_path))],
        check=True,
        cwd=Path(__file__).resolve().parents[2],
    )
