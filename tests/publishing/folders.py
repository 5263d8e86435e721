"""Results written by hand, as `forestrl eval` and `forestrl train` lay them out."""

from __future__ import annotations

import json
from pathlib import Path

SIDES = {"nominal": (50, 45), "trees75": (50, 75), "size75": (75, 101)}
STEPS = 2500


def row(measure, value, margin=None, n=2):
    low, high = (None, None) if margin is None else (value - margin, value + margin)
    return {"measure": measure, "mean": value, "low": low, "high": high, "n": n}


def write_evaluation(
    root: Path, setting="nominal", name="paper", coverage=(0.9, 0.8), rate=0.1, endings=None
):
    """An arena for each coverage, which holds from the first step on; under 10 % it is stuck."""
    folder = root / setting / name
    folder.mkdir(parents=True)
    size, trees = SIDES[setting]
    average = sum(coverage) / len(coverage)
    reached = sum(share >= 0.1 for share in coverage) / len(coverage)
    ends = {"covered": 1.0} if endings is None else endings
    measures = [
        *(row(f"coverage_{step}", average, 0.01) for step in (250, 500, 1000, 2000, STEPS)),
        row("steps_to_98", 400, 10),
        row("reached_98", reached),
        *(row(f"area_{upto}", average, 0.01) for upto in (500, 2500)),
        row("intervention_rate", rate, 0.01 if rate else 0.0),
        row("percentile_80", rate),
        row("share_under_15", 1.0),
        row("collisions", 0.0),
        *(row(f"ended_{kind}", share) for kind, share in ends.items()),
    ]
    meta = {
        "command": f"forestrl eval policy={name}",
        "env": {"size": size, "n_trees": trees, "tree_radius": [1.0, 3.0]},
        "eval": {"seed": 0},
    }
    summary = {"arenas": len(coverage), "steps": STEPS, "measures": measures, "meta": meta}
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
        values = (1000 * (i + 1), value, value / 100, coverage, coverage, collisions)
        lines.append(",".join(map(str, values)))
    path.write_text("\n".join(lines) + "\n")
    return path


def write_job(folder: Path, *overrides: str):
    """What Hydra writes into the folder of a sweep's job."""
    (folder / ".hydra").mkdir(parents=True)
    text = "".join(f"- {override}\n" for override in overrides) or "[]\n"
    (folder / ".hydra/overrides.yaml").write_text(text)
    return folder
