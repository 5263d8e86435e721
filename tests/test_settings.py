"""What a setting may be: kinds, ranges, and the words for both."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from omegaconf import OmegaConf

from forestrl.settings import Range, allows, check, checked, describe, is_path
from forestrl.wording import decimal, nearest, written

ENDS = st.none() | st.integers(-5, 5)
Side = Annotated[int, Range(3, 1000)]

KINDS = [  # kind, in words, allowed, not allowed
    (int, "a whole number", [0, -3, np.int64(2)], [True, 1.0, "1", None, math.inf]),
    (float, "a number", [0, -1.5, 1e300], [True, math.nan, math.inf, -math.inf, "1", None]),
    (bool, "true or false", [True, False], [0, 1, "true", None]),
    (str, "text", ["", "1"], [1, None, True]),
    (Path, "a path", ["outputs", Path("a")], [1, None, True]),
    (str | None, "text, or null", ["a", None], [0, False]),
    (Side, "a whole number from 3 to 1000", [3, 1000], [2, 1001, 3.0, None]),
    (Annotated[float, Range(above=0)], "a number more than 0", [1e-9, 5], [0, -1, math.nan]),
    (Annotated[float, Range(0)], "a number of at least 0", [0, 0.5], [-1e-9, "0"]),
    (
        Annotated[float, Range(above=0, high=1)],
        "a number more than 0 and at most 1",
        [0.1, 1],
        [0, 1.1],
    ),
    (
        Annotated[int, Range(1, odd=True)],
        "an odd whole number of at least 1",
        [1, 7],
        [0, 2, -1, 7.0],
    ),
    (Side | None, "a whole number from 3 to 1000, or null", [None, 5], [2, "5"]),
    (Literal["mean", "concat"], "mean or concat", ["mean"], ["sum", None, 0]),
    (Literal[1, 2, 3], "1, 2 or 3", [1], [True, 1.0, 4]),
    (list[int], "a list of whole numbers", [[], [1], (1, 2)], [1, [1.0], "12", None]),
    (
        Annotated[list[Side], Range(1)],
        "a list of one or more whole numbers from 3 to 1000",
        [[3], [3, 5]],
        [[], [2], 3, "3"],
    ),
    (
        tuple[float, float],
        "a list of 2 numbers",
        [(1, 2.5), [0, 0]],
        [(1,), (1, 2, 3), (1, "2"), 1],
    ),
    (
        Side | tuple[Side, Side],
        "a whole number from 3 to 1000 or a list of 2 whole numbers from 3 to 1000",
        [5, [3, 4]],
        [2, [3, 2], [3]],
    ),
    (Any, "", [1, None, "x", math.nan], []),
    (Callable[[], int], "", [1, None], []),
    (None, "", [None], [0]),
]


@pytest.mark.parametrize(("kind", "words", "allowed", "refused"), KINDS)
def test_a_kind_allows_its_values_and_no_others(kind, words, allowed, refused):
    assert [value for value in allowed if not allows(kind, value)] == []
    assert [value for value in refused if allows(kind, value)] == []
    assert describe(kind) == words


@given(ENDS, ENDS, ENDS, st.booleans(), st.integers(-6, 6))
def test_a_range_holds_what_its_ends_say(low, high, above, odd, value):
    expected = (low is None or low <= value) and (high is None or value <= high)
    expected = (
        expected and (above is None or above < value) and not (odd and value in range(-6, 7, 2))
    )
    assert (value in Range(low, high, above, odd)) == expected


def test_lists_of_the_configuration_are_lists():
    values = OmegaConf.create({"sizes": [3, 5], "radius": [1.0, 3]})
    check(values, {"sizes": list[Side], "radius": tuple[float, float]})
    with pytest.raises(ValueError, match=r"^sizes=\[3,2\] is not allowed: it must be a list of"):
        check({"sizes": OmegaConf.create([3, 2])}, {"sizes": list[Side]})


def test_a_refusal_names_setting_value_and_range():
    message = r"^env\.size=2 is not allowed: it must be a whole number from 3 to 1000$"
    with pytest.raises(ValueError, match=message):
        check({"size": 2}, {"size": Side}, "env.")
    check({"size": 2}, {})  # nothing is known of it


class Forest:
    @checked
    def __init__(self, size: Side, beta: "float" = 0.5, *, near: "NotThere" = None, **more: int):  # noqa: F821
        self.size, self.beta, self.near, self.more = size, beta, near, more


def test_a_constructor_that_is_checked_refuses_what_its_annotations_do_not_allow():
    for values, message in (
        ({"size": 2}, "size=2 is not allowed: it must be a whole number from 3 to 1000"),
        ({"size": 3, "beta": "high"}, "beta=high is not allowed: it must be a number"),
        ({"size": 3, "beta": None}, "beta=null is not allowed: it must be a number"),
    ):
        with pytest.raises(ValueError) as caught:
            Forest(**values)
        assert str(caught.value) == message


def test_a_constructor_that_is_checked_is_called_as_before():
    forest = Forest(3, 1, near="anything", trees=4)
    assert (forest.size, forest.beta, forest.near, forest.more) == (3, 1, "anything", {"trees": 4})
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'size'"):
        Forest()


def test_paths_are_known_as_such():
    assert is_path(Path) and is_path(Path | None) and is_path(Annotated[str | Path, "folder"])
    assert not is_path(str) and not is_path(None) and not is_path(int | None)


def test_values_are_written_as_one_types_them():
    assert written([True, None, 1e-9, "a", (2, 3)]) == "[true,null,1e-09,a,[2,3]]"
    assert (decimal(0.98), decimal(1000), decimal(100_000)) == ("0.98", "1000", "100_000")
    assert decimal(2**63 - 1) == "2^63 - 1"


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("env.sizze", ": did you mean env.size?"),
        ("evn.size", ": did you mean env.size?"),
        ("arenas", ": did you mean eval.arenas?"),
        ("totalframes", ": did you mean total_frames?"),
        ("zebra", ""),
    ],
)
def test_a_misspelt_setting_is_told_the_nearest(name, meant):
    assert nearest(name, ["env.size", "eval.arenas", "total_frames", "graph.window"]) == meant
