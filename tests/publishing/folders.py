"""Results written by hand, as `forestrl eval` and `forestrl train` lay them out."""

from __future__ import annotations

import json
from pathlib import Path

SIDES = {"nominal": (50, 45), "trees75": (50, 75), "size75": (75, 101)}
STEPS = 2500


def mean(value, margin=0.01):
    return {"mean": value, "low": value - margin, "high": value + margin}


def write_evaluation(
    root: Path, setting="nominal", name="learned", coverage=(0.9, 0.8), rate=0.1, endings=None
):
    """An arena for each coverage, which holds from the first step on; under 10 % it is stuck."""
    folder = root / setting / name
    folder.mkdir(parents=True)
    size, trees = SIDES[setting]
    average = sum(coverage) / len(coverage)
    reached = sum(share >= 0.1 for share in coverage) / len(coverage)
    summary = {
        "arenas": len(coverage),
        "steps": STEPS,
        "coverage": {str(step): mean(average) for step in (250, 500, 1000, 2000, STEPS)},
        "steps_to": {"98": mean(400, 10) | {"reached": reached}},
        "area_under_curve": {"500": mean(average), "2500": mean(average)},
        "interventions": {
            "rate": mean(rate, 0.01 if rate else 0.0),
            "percentile_80": rate,
            "share_under_15": 1.0,
        },
        "collisions": 0,
        "endings": {"covered": 1.0} if endings is None else endings,
        "meta": {
            "command": f"forestrl eval policy={name}",
            "env": {"size": size, "n_trees": trees, "tree_radius": [1.0, 3.0]},
            "eval": {"seed": 0},
        },
    }
    (folder / "summary.json").write_text(json.dumps(summary))
    steps = ["" if share < 0.1 else str(400 + i) for i, share in enumerate(coverage)]
    rows = [f"{i},{share},{share},{rate},{steps[i]}" for i, share in enumerate(coverage)]
    head = "index,coverage,coverage_500,intervention_rate,steps_to_98"
    (folder / "episodes.csv").write_text("\n".join([head, *rows]) + "\n")
    curve = [f"{step},{average},{average - 0.01},{average + 0.01}" for step in (0, 500, STEPS)]
    (folder / "curve.csv").write_text("\n".join(["step,mean,low,high", *curve]) + "\n")
    return folder


def write_training(path: Path, returns=(0.0, 50.0, 100.0), evaluated=()):
    """A row each 1000 frames; the evaluations' coverage in the last rows."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ["frames,rollout/return,rollout/coverage,eval/coverage,eval/auc,eval/collisions"]
    blank = len(returns) - len(evaluated)
    for i, value in enumerate(returns):
        coverage = evaluated[i - blank] if i >= blank else ""
        collisions = 0 if i >= blank else ""
        row = (1000 * (i + 1), value, value / 100, coverage, coverage, collisions)
        lines.append(",".join(map(str, row)))
    path.write_text("\n".join(lines) + "\n")
    return path
