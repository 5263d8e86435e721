"""The container's entry: where results go, and what to do if they cannot be written."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

ENTRYPOINT = Path(__file__).resolve().parents[1] / "docker" / "entrypoint.sh"
SOMEBODY = 65534
PROGRAM = """#!/bin/sh
echo "home $HOME, kernels $NUMBA_CACHE_DIR: $*"
ls "$HOME"
"""

pytestmark = pytest.mark.skipif(shutil.which("findmnt") is None, reason="needs util-linux")


def mount_of(folder):
    words = ["findmnt", "--noheadings", "--output", "TARGET", "--target", folder]
    return subprocess.run(words, capture_output=True, text=True).stdout.strip()


class Container:
    """A home and a working folder, a program that says what it is given, and one who runs it."""

    def __init__(self, folder, programs):
        self.folder, self.bin = Path(folder), Path(programs)
        self.folder.chmod(0o755)
        self.bin.chmod(0o755)
        self.work, self.home = self.make("work"), self.make("home")
        (self.home / "compiled").touch()
        for name, text in (("forestrl", PROGRAM), ("entrypoint", ENTRYPOINT.read_text())):
            (self.bin / name).write_text(text)
            (self.bin / name).chmod(0o755)

    def make(self, name, mode=0o777):
        folder = self.folder / name
        folder.mkdir()
        folder.chmod(mode)
        return folder

    def run(self, *arguments, temporary="/tmp"):
        words = [str(self.bin / "entrypoint"), *arguments]
        if os.geteuid() == 0:  # who may write everywhere
            user = [f"--reuid={SOMEBODY}", f"--regid={SOMEBODY}", "--clear-groups"]
            words = ["setpriv", *user, *words]
        environment = {
            "PATH": f"{self.bin}:{os.environ['PATH']}",
            "HOME": str(self.home),
            "NUMBA_CACHE_DIR": f"{self.home}/numba",
            "TMPDIR": temporary,
        }
        result = subprocess.run(
            words,
            cwd=self.work,
            env=environment,
            capture_output=True,
            text=True,
        )
        return result.returncode, result.stdout, result.stderr


def containers(place):
    """In a folder that anybody may enter; the programs in one where they may be run."""
    with (
        tempfile.TemporaryDirectory(dir=place) as folder,
        tempfile.TemporaryDirectory(dir="/tmp") as programs,
    ):
        yield Container(folder, programs)


@pytest.fixture
def mounted():
    """One whose working folder lies in a mounted file system."""
    if mount_of("/dev/shm") == "/":
        pytest.skip("no file system is mounted here")
    yield from containers("/dev/shm")


@pytest.fixture
def bare():
    """One whose working folder is a part of the whole."""
    if mount_of("/var/tmp") != "/":
        pytest.skip("a file system is mounted here")
    yield from containers("/var/tmp")


def test_it_hands_over_all_words(mounted):
    status, out, err = mounted.run("train", "a=b c", "d=[1, 2]")
    assert (status, err) == (0, "")
    assert (
        out
        == f"home {mounted.home}, kernels {mounted.home}/numba: train a=b c d=[1, 2]\ncompiled\n"
    )


def test_without_a_mounted_folder_it_says_that_results_stay(bare):
    status, out, err = bare.run("eval", "env.n_trees=5")
    assert status == 0 and "eval env.n_trees=5" in out
    (line,) = err.splitlines()
    assert "stay in this container" in line
    assert f'-v "$PWD:{bare.work}" forestrl eval env.n_trees=5' in line


@pytest.mark.parametrize(
    "words", [(), ("--help",), ("eval", "--help"), ("--version",), ("train", "--cfg", "job")]
)
def test_what_writes_nothing_is_not_spoken_of(words, bare):
    bare.work.chmod(0o555)
    assert bare.run(*words)[::2] == (0, "")


def test_a_folder_for_results_of_ones_own_is_nobody_elses_business(bare):
    bare.work.chmod(0o555)
    assert bare.run("eval", "hydra.run.dir=/elsewhere")[::2] == (0, "")


def refusal(container, *words):
    status, out, err = container.run(*words)
    assert status == 1 and out == ""
    (line,) = err.splitlines()
    return line


@pytest.mark.parametrize("name", ["", "outputs", "multirun"])
def test_a_mounted_folder_that_cannot_be_written_is_said_with_what_to_do(name, mounted):
    folder = mounted.make(name, 0o555) if name else mounted.work
    if name:
        shutil.move(folder, mounted.work / name)
        folder = mounted.work / name
    folder.chmod(0o555)
    line = refusal(mounted, "eval")
    assert line.startswith(f"forestrl: {folder} ")
    owner = folder.stat().st_uid
    assert ("sudo chown" in line) == (owner == 0)
    if os.geteuid() == 0:
        os.chown(folder, 1234, 5678)
        assert "add --user 1234:5678" in refusal(mounted, "eval")


def test_a_read_only_container_needs_a_folder(bare):
    bare.work.chmod(0o555)
    assert f'-v "$PWD:{bare.work}" forestrl eval' in refusal(bare, "eval")


def test_a_read_only_home_is_copied(mounted):
    mounted.home.chmod(0o555)
    status, out, err = mounted.run("eval")
    assert (status, err) == (0, "")
    copy = Path(out.split()[1].rstrip(","))
    assert copy != mounted.home and out == f"home {copy}, kernels {copy}/numba: eval\ncompiled\n"
    shutil.rmtree(copy)


def test_without_a_temporary_folder_it_says_how_to_have_one(mounted):
    mounted.home.chmod(0o555)
    nowhere = mounted.make("nowhere", 0o555)
    status, _, err = mounted.run("eval", temporary=str(nowhere))
    assert status == 1 and err.splitlines() == [err.strip()] and "--tmpfs /tmp" in err
