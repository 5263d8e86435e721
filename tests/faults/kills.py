"""Kills trainings at random instants until they are through; each must equal one left alone.

By hand, with as many kills as one likes::

    python -m tests.faults.kills 50

At every other kill the signal waits for a file that is being written. Each training is a process
of its own, forked from this one, which has imported what is slow to import.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from pathlib import Path

import torch

import forestrl.jobs.train  # once, for all children
from forestrl.learning.checkpoint import load_training
from forestrl.policies.files import load_policy
from tests.commands import forestrl, rows

WORDS = (
    *("experiment=smoke", "total_frames=2048", "checkpoint_every=256"),
    *("eval.every=512", "eval.steps=20"),
)
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
POLITE = {signal.SIGTERM: 143, signal.SIGINT: 130}


def start(folder: Path) -> int:
    """Begins a training in a child process, or goes on with it; gives the process id."""
    begun = (folder / "metrics.csv").exists()
    words = [f"resume={folder}"] if begun else [*WORDS, f"hydra.run.dir={folder}"]
    child = os.fork()
    if child:
        return child
    for number in POLITE:  # until the program listens to them
        signal.signal(number, signal.SIG_DFL)
    status = 1
    try:
        result = forestrl("train", *words)
        status = int(result.status or 0)
        if status not in (0, *POLITE.values()):
            os.write(2, f"{words} ended with {status}: {result.err}\n".encode())
    finally:
        os._exit(status)


def wait(child: int) -> int:
    """The exit status of a child; negative for the signal that ended it."""
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def kill(child: int, folder: Path, number: int, instant: float, while_writing: bool) -> int:
    """Sends a signal at an instant, or when a file is written after it; gives the exit status."""
    begun = time.monotonic()
    while True:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        writing = not while_writing or any(folder.rglob(".*.part"))
        if time.monotonic() - begun >= instant and writing:
            os.kill(child, number)
            return wait(child)
        time.sleep(0.0005 if while_writing else 0.005)


def same(ours: object, theirs: object) -> bool:
    """Tells whether two states are equal, tensors bit for bit."""
    if isinstance(ours, torch.Tensor):
        return torch.equal(ours, theirs)
    if isinstance(ours, dict):
        return ours.keys() == theirs.keys() and all(same(ours[k], theirs[k]) for k in ours)
    if isinstance(ours, list | tuple):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    return ours == theirs


def compare(folder: Path, whole: Path) -> None:
    """Requires the same metrics, weights, optimiser, arenas and sources of randomness."""
    assert rows(folder / "metrics.csv") == rows(whole / "metrics.csv")
    for alias in ("best", "latest"):
        ours, theirs = (load_policy(each / "checkpoints" / alias) for each in (folder, whole))
        assert same(ours.weights, theirs.weights) and ours.training == theirs.training, alias
    ours, theirs = (load_training(each / "checkpoints/latest") for each in (folder, whole))
    for state in (ours, theirs):  # the numbers of the trajectories, which nothing reads
        arenas = state["collector"]["arenas"]
        state["collector"]["arenas"] = {
            name: value for name, value in arenas.items() if not name.startswith("collector/")
        }
    assert same(ours, theirs)
    assert not list(folder.rglob(".*.part"))


def run(kills: int, folder: Path, seed: int = 0) -> int:
    """Kills that many times; gives how many trainings got through and were compared."""
    draw, whole = random.Random(seed), folder / "whole"
    begun = time.monotonic()
    assert wait(start(whole)) == 0
    length, number, trainings = time.monotonic() - begun, 0, 0
    while number < kills:
        trainings += 1
        ours, status = folder / str(trainings), 1
        while status != 0:
            if number == kills:
                status = wait(start(ours))
                assert status == 0, status
                break
            sent = draw.choice(SIGNALS)
            instant = draw.uniform(0, length)
            status = kill(start(ours), ours, sent, instant, while_writing=number % 2 == 1)
            assert status in (0, -sent, POLITE.get(sent)), status
            number += status != 0
        compare(ours, whole)
        print(f"{number} kills, {trainings} trainings equal to one left alone", flush=True)
    return trainings


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        run(int(sys.argv[1]) if len(sys.argv) > 1 else 50, Path(place))
