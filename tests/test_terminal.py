"""Commands on terminals that take no more than ASCII, are closed, or whose reader has gone."""

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from forestrl.terminal import lasting_output

ROOT = Path(__file__).resolve().parents[1]
MAIN = f'{sys.executable} -c "from forestrl.cli import main; main()"'
TINY = "env=tiny policy=random eval.arenas=2 eval.steps=5 hydra.run.dir=out"


def shell(command, folder, **environment):
    """Runs a line in bash, with ``forestrl`` in it."""
    env = os.environ | {"PYTHONPATH": str(ROOT)} | environment
    line = command.replace("forestrl", MAIN)
    return subprocess.run(["bash", "-c", line], cwd=folder, env=env, capture_output=True, text=True)


@pytest.mark.parametrize(
    "environment",
    [
        {"PYTHONIOENCODING": "ascii"},
        {"PYTHONIOENCODING": "latin-1"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    ],
    ids=["ascii", "latin-1", "C"],
)
def test_a_terminal_without_unicode_is_told_what_it_can_show(environment, tmp_path):
    result = shell(f"forestrl eval {TINY}", tmp_path, **environment)
    assert (result.returncode, result.stderr) == (0, "")
    assert "steps to 98 %" in result.stdout and "–" not in result.stdout  # the dash of "in no run"
    assert (tmp_path / "out/summary.json").is_file()


@pytest.mark.parametrize(
    "line",
    [
        "forestrl --help | true",
        "forestrl train --help | head -1",
        "forestrl train --cfg job | head -1",
        "forestrl nonsense 2>&1 >/dev/null | true",
        "forestrl --help >&-",
        "forestrl train env.size=large 2>&-",
    ],
)
def test_no_traceback_where_nobody_reads(line, tmp_path):
    assert "Traceback" not in (result := shell(line, tmp_path)).stderr
    assert "Error" not in result.stderr and "Exception" not in result.stderr


@pytest.mark.parametrize("streams", [">&- 2>&-", "2>&1 | true", "> >(true) 2> >(true)"])
def test_work_goes_on_where_nobody_reads(streams, tmp_path):
    shell(f"forestrl eval {TINY} {streams}; wait", tmp_path)
    assert (tmp_path / "out/summary.json").is_file()


def test_the_streams_are_as_before_afterwards():
    before = sys.stdout, sys.stderr
    with lasting_output():
        assert sys.stdout is not before[0] and sys.stdout.encoding == before[0].encoding
    assert (sys.stdout, sys.stderr) == before


def test_other_errors_of_a_stream_are_not_hidden(monkeypatch):
    closed = io.StringIO()
    monkeypatch.setattr(sys, "stdout", closed)
    with pytest.raises(ValueError, match="closed file"), lasting_output():
        closed.close()
        print("lost")
