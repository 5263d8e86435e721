"""``forestrl plan``: lines of JSON from another process."""

from __future__ import annotations

import base64
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from torchrl.envs import Compose, TransformedEnv

from forestrl import keys as K
from forestrl.envs import SafetyFilter
from forestrl.planner import Planner
from forestrl.planner.lines import Lines
from forestrl.planner.policies import policy_named
from tests.envs.worlds import make_forest
from tests.planner.test_planner import CORRIDOR, drawn

ROOT = Path(__file__).resolve().parents[2]


def start(*settings):
    words = [sys.executable, "-m", "forestrl.plan", *settings]
    env = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    pipe = subprocess.PIPE
    return subprocess.Popen(words, stdin=pipe, stdout=pipe, env=env, text=True)


def ask(process, **request):
    process.stdin.write(json.dumps(request) + "\n")
    process.stdin.flush()
    return json.loads(process.stdout.readline())


def grid_of(cells):
    """An agent's map as a robot would publish it."""
    data = np.array([-1, 0, 100], np.int8)[cells.numpy()]
    shape = {"height": data.shape[0], "width": data.shape[1], "resolution": 1.0, "origin": [0, 0]}
    return shape | {"data": base64.b64encode(data.tobytes()).decode()}


@pytest.mark.parametrize(
    ("name", "arenas"),
    [
        ("path_gain", 5),
        pytest.param("path_gain", 100, marks=pytest.mark.heavy),
        pytest.param("nearest_frontier", 100, marks=pytest.mark.heavy),
        pytest.param("learned", 100, marks=pytest.mark.heavy),
    ],
)
def test_another_process_closes_the_loop_as_the_env_does(name, arenas, tmp_path):
    env = TransformedEnv(
        make_forest(size=14, n_trees=9, lidar_range=3.0, max_steps=80), Compose(SafetyFilter())
    )
    policy, _ = policy_named(name)(3.0)
    process = start(f"planner.policy={name}", "planner.lidar_range=3", "planner.beyond_edge=wall")
    steps = 0
    with process:
        for arena in range(arenas):
            assert ask(process, type="start", id=arena) == {
                "schema": 1,
                "id": arena,
                "done": "start",
            }
            td = env.reset()
            while not td["done"]:
                td = policy(td)
                row, col = td[K.POSITION].tolist()
                said = ask(process, grid=grid_of(td[K.CELLS]), pose=[col + 0.5, row + 0.5])
                td = env.step(td)
                assert said["action"] == td["next", K.EXECUTED].item(), (arena, said)
                steps, td = steps + 1, env.step_mdp(td)
        process.stdin.close()
        assert process.wait() == 0 and process.stdout.read() == ""
    assert steps > 15 * arenas


BAD = [
    ("", "Expecting value"),
    ("[1]", "no JSON object"),
    ('{"type": "fly"}', "type='fly' is not allowed: it must be one of plan, reject"),
    ('{"schema": 2}', "schema=2 is not allowed"),
    ('{"posture": [0, 0]}', "posture is no field of a plan request"),
    ('{"type": "restore", "state": 3}', "the state of policy=None"),
    ('{"type": "reject", "goal": [0]}', "goal has 1 numbers"),
    ('{"grid": {"data": "*"}}', "data is no base64"),
    ("[" * 100_000, "recursion"),
]


@pytest.mark.parametrize(("line", "words"), BAD, ids=lambda text: text[:20])
def test_a_line_that_is_no_request_is_answered_with_an_error(line, words):
    answer = json.loads(Lines(Planner("path_gain")).answer(line))
    assert words in answer["error"] and "status" not in answer


def test_requests_keep_their_id_and_the_last_grid():
    lines, (grid, pose) = Lines(Planner("nearest_frontier", beyond_edge="wall")), drawn(CORRIDOR)
    assert json.loads(lines.answer('{"id": 1}'))["status"] == "waiting_for_map"
    first = json.loads(lines.answer(json.dumps({"id": "a", "grid": grid, "pose": pose})))
    assert (first["id"], first["status"], first["waypoint"]) == ("a", "exploring", [1.5, 1.5])
    again = json.loads(lines.answer(json.dumps({"id": "b", "pose": [2.5, 1.5]})))
    assert (again["id"], again["waypoint"]) == ("b", [3.5, 1.5])
    state = json.loads(lines.answer('{"type": "state"}'))["state"]
    assert json.loads(lines.answer(json.dumps({"type": "restore", "state": state})))["done"]
    assert json.loads(lines.answer('{"type": "reject"}'))["set_aside"] == again["goal"]


def test_sigterm_ends_it_cleanly():
    process = start("planner.policy=path_gain")
    with process:
        assert "error" in ask(process, type="nothing")
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=60) == 0 and process.stdout.read() == ""
