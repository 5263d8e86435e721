"""The count of collisions: none with the filter, some without it."""

import pytest

from tests.commands import forestrl, rows

TINY = (
    "collisions.sizes=[14]",
    "collisions.densities=[45]",
    "collisions.arenas=4",
    "collisions.steps=60",
)


def test_only_without_the_filter_there_are_collisions(tmp_path):
    result = forestrl("collisions", *TINY, f"hydra.run.dir={tmp_path}")
    assert result.status == 0, result.err
    table = rows(tmp_path / "collisions.csv")
    counted = {(row["policy"], row["filter"]): int(row["collisions"]) for row in table}
    assert counted["random", "on"] == counted["paper", "on"] == 0
    assert counted["random", "off"] > 0
    assert {(row["size"], row["n_trees"], row["steps"]) for row in table} == {("14", "4", "240")}
    (line,) = (line for line in result.out.splitlines() if line.startswith("random   filter off"))
    assert line.split()[-2] == str(counted["random", "off"])


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("policy=random", "policy=random is not allowed"),
        ("collisions.steps=0", "collisions.steps=0 is not allowed"),
        ("graph.window=5", "was made with graph.window=7, but graph.window=5 was asked for"),
    ],
)
def test_what_cannot_be_compared_is_refused(override, words, tmp_path):
    result = forestrl("collisions", *TINY, override, f"hydra.run.dir={tmp_path}")
    assert result.status == 1
    (line,) = result.err.splitlines()
    assert words in line
