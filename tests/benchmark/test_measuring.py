"""Timing: in turns, by the frame, and as rows."""

import csv
import io
import time

import pytest
import torch
from torch.utils.benchmark import Measurement, TaskSpec

from forestrl.benchmark.measuring import Stage, known, measure, to_csv
from forestrl.benchmark.scaling import growth, work

ABOUT = {"rows": 3, "columns": 4, "num_envs": 2}


def step(stage, num_envs, cells, seconds):
    """A measurement of a step that looks at so many cells."""
    spec = TaskSpec("call()", "pass", sub_label=stage, description=str(num_envs))
    return Measurement(1, [seconds], spec, {"work": cells, "num_envs": num_envs})


@pytest.mark.parametrize("singly", [False, True])
def test_stages_are_called_in_turns(singly):
    called = []
    pair = [Stage(name, 1, lambda name=name: called.append(name)) for name in "ab"]
    first, second = measure(pair, "a frame", ABOUT, 0.003, singly=singly)
    assert (first.sub_label, second.sub_label) == ("a", "b")
    turns = [name for i, name in enumerate(called) if i == 0 or called[i - 1] != name]
    assert turns == list("ab") * (500 if singly else 3)
    if singly:
        assert len(first.times) == len(second.times) == 500


def test_times_are_those_of_a_frame():
    start = time.perf_counter()
    nap = Stage("nap", 4, lambda: time.sleep(0.004))
    (measured,) = measure([nap], "a frame", ABOUT, 0.03)
    passed = time.perf_counter() - start
    assert min(measured.times) >= 0.001
    assert 4 * sum(measured.times) <= passed


def test_a_long_call_is_timed_once_after_one_that_warms_up():
    called = []
    stage = Stage("long", 1, lambda: called.append(sum(range(10**6))))
    (measured,) = measure([stage], "a frame", ABOUT, 1e-6)
    assert len(called) == 2 and len(measured.times) == 1


def test_what_is_known_of_a_measurement_becomes_a_row():
    seconds = [1.0, 2.0, 3.0, 4.0, 5.0]
    spec = TaskSpec("call()", "pass", sub_label="+ graph")
    about = {**ABOUT, "stage": "+ graph", "version": "", "coverage": 1 / 3}
    (row,) = csv.DictReader(io.StringIO(to_csv([Measurement(1, seconds, spec, about)])))
    wanted = {"rows": "3", "stage": "+ graph", "seconds": "3", "iqr": "2", "repeats": "5"}
    wanted |= {"coverage": "0.333333", "frames_per_second": "0.333333", "percentile_99": ""}
    assert row.items() >= wanted.items()


def test_versions_of_a_stage_stand_in_columns_of_a_table():
    pair = [Stage("sense", 1, lambda: None, version) for version in ("compiled", "reference")]
    measured = measure(pair, "a map", ABOUT, 0.001)
    assert [each.description for each in measured] == ["compiled", "reference"]
    assert {each.label for each in measured} == {"3 x 4 cells: a map"}
    assert [known(each)["version"] for each in measured] == ["compiled", "reference"]


def test_a_stage_without_versions_stands_by_its_number_of_arenas():
    (measured,) = measure([Stage("env step", 2, lambda: None)], "a frame", ABOUT, 0.001)
    assert measured.description == "2" and measured.num_threads == torch.get_num_threads()


def test_work_is_counted_by_hand():
    about = {"rows": 10, "columns": 20, "frontiers": 11}
    assert work("env step", about) == work("+ filter", about) == 200
    assert work("+ graph", about) == work("evaluation step", about) == 2 * 200 + (9 + 11) * 49
    assert work("+ reward", about) == 3 * 200 + (9 + 11) * 49 + 11 * 49
    assert work("policy forward", about) == 9 + 11


def test_growth_is_the_largest_over_arenas_and_their_number():
    measured = [
        step("env step", 1, 100, 1.0),
        step("env step", 1, 400, 2.0),  # 2 / 4
        step("env step", 8, 100, 1.0),
        step("env step", 8, 400, 6.0),  # 6 / 4
        step("env step", 8, 200, 1.0),  # 1 / 2
        step("+ graph", 8, 300, 1.0),
        step("+ graph", 8, 900, 1.5),  # 1.5 / 3
    ]
    assert growth(measured) == {"env step": 1.5, "+ graph": 0.5}


def test_growth_needs_two_arenas():
    assert growth([step("env step", n, 100, 1.0) for n in (1, 2)]) == {}
