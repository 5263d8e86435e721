"""Commands where little may be written, and from where they change the working folder."""

import ctypes
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands import SHORT, forestrl, train

ROOT = Path(__file__).resolve().parents[1]
_DROP_FROM_BOUNDING_SET, _OVERRIDE_MODES = 24, 1  # PR_CAPBSET_DROP, CAP_DAC_OVERRIDE


def respect_modes():
    """Takes from root, before it runs a program, the right to write where modes forbid it."""
    ctypes.CDLL(None).prctl(_DROP_FROM_BOUNDING_SET, _OVERRIDE_MODES, 0, 0, 0)


@pytest.fixture
def read_only(tmp_path):
    """A copy of the package and a home, neither of which can be written to."""
    site, home = tmp_path / "site", tmp_path / "home"
    leave_out = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "forestrl", site / "forestrl", ignore=leave_out)
    shutil.copytree(ROOT / "conf", site / "conf")
    home.mkdir()
    folders = [path for path in (*tmp_path.rglob("*"), home) if path.is_dir()]
    for path in folders:
        path.chmod(0o555)
    probe = [sys.executable, "-c", f"open({str(site / 'probe')!r}, 'w')"]
    written = subprocess.run(probe, preexec_fn=respect_modes, stderr=subprocess.DEVNULL)
    yield None if written.returncode == 0 else (site, home)
    for path in folders:
        path.chmod(0o755)


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    ["--help", "eval --help", "eval env=tiny policy=nearest_frontier eval.arenas=1 eval.steps=5"],
)
def test_commands_work_with_package_and_home_read_only(words, read_only, tmp_path):
    if read_only is None:
        pytest.skip("this user may write to read-only folders")
    site, home = read_only
    (tmp_path / "work").mkdir()
    program = [sys.executable, "-c", "from forestrl.cli import main; main()"]
    environment = {"PYTHONPATH": str(site), "HOME": str(home), "PATH": os.environ["PATH"]}
    result = subprocess.run(
        [*program, *words.split()],
        preexec_fn=respect_modes,
        cwd=tmp_path / "work",
        env=environment,
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr
    assert "Traceback" not in result.stderr
    assert not list(site.rglob("__pycache__")) and not list(home.iterdir())


def test_paths_mean_what_they_meant_where_the_command_was_started(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    train(Path("run"), *SHORT)
    words = ("env=tiny", "eval.arenas=1", "eval.steps=5", "hydra.job.chdir=true")
    result = forestrl("eval", *words, "checkpoint=run", "hydra.run.dir=out")
    assert result.status == 0, result.err
    summary = json.loads((tmp_path / "out/summary.json").read_text())
    assert summary["meta"]["checkpoint"] == str(tmp_path / "run")
    result = forestrl("train", "resume=run", "total_frames=512", "hydra.job.chdir=true")
    assert result.status == 0, result.err
    result = forestrl(
        "eval", "-m", *words, "checkpoint=run", "eval.seed=0,1", "hydra.sweep.dir=both"
    )
    assert result.status == 0, result.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["both", "out", "run"]
