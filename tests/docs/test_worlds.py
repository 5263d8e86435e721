"""The page on worlds: its numbers are those of the results."""

import json
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_numbers_on_worlds_are_those_of_the_results():
    row = re.compile(r"^\| `(\w+)` \| `(\w+)` \| (.+) \| (.+) \| `(forestrl .+)` \|$", re.MULTILINE)
    rows = row.findall((ROOT / "docs/worlds.md").read_text())
    assert len(rows) >= 4
    for world, policy, *steps, command in rows:
        summary = json.loads(
            (ROOT / f"multirun/results/worlds/{world}/{policy}/summary.json").read_text()
        )
        found = {each["measure"]: each for each in summary["measures"]}
        assert summary["meta"]["command"] == command
        assert (found["collisions"]["mean"], found["reached_98"]["mean"]) == (0, 1)
        for share, text in zip((80, 98), steps, strict=True):
            mean, low, high = (found[f"steps_to_{share}"][key] for key in ("mean", "low", "high"))
            assert text == f"{mean:.0f} [{low:.0f}, {high:.0f}]"
