"""Collisions counted with and without the filter: ``forestrl collisions``."""

from __future__ import annotations

import csv
import io
import itertools
import sys
from functools import partial
from typing import Any

from omegaconf import DictConfig, OmegaConf
from tqdm.auto import tqdm

from forestrl import build
from forestrl.command import asked_for, run_folder
from forestrl.evaluation.episodes import evaluate
from forestrl.planners import RandomWalk
from forestrl.storage import atomic_write

_COLUMNS = ("policy", "filter", "size", "n_trees", "steps", "interventions", "collisions")


def count(cfg: DictConfig, policy: Any, forest: dict[str, int], filtered: bool) -> dict[str, Any]:
    """Runs a policy in forests of one kind and counts steps, interventions and collisions."""
    settings, changed = cfg.collisions, cfg.copy()
    OmegaConf.update(changed, "env", forest)
    if not filtered:
        OmegaConf.update(changed, "safety", {"_target_": None}, merge=False)
    episodes = evaluate(
        partial(build.make_env, changed, policy=policy),
        policy,
        seed=settings.seed,
        indices=range(settings.arenas),
        steps=settings.steps,
        batch=settings.arenas,
    )
    return {
        "filter": "on" if filtered else "off",
        **forest,
        "steps": settings.arenas * settings.steps,
        "interventions": int(episodes.intervened.sum()),
        "collisions": int(episodes.collisions.sum()),
    }


def run(cfg: DictConfig) -> int:
    """Runs a random and the paper's policy over sizes and densities; returns the filter's failures.

    The random policy draws among all nine actions. Without the filter both collide.
    """
    folder = run_folder(cfg)
    build.prepare(cfg)
    paper, _ = build.make_policy(cfg, asked_for())
    policies = {"random": RandomWalk(feasible_only=False), "paper": paper}
    forests = [
        {"size": size, "n_trees": round(density * size**2 / 50**2)}
        for size, density in itertools.product(cfg.collisions.sizes, cfg.collisions.densities)
    ]
    runs = list(itertools.product(policies, (True, False), forests))
    rows = []
    for name, filtered, forest in tqdm(runs, disable=not sys.stderr.isatty()):
        rows.append({"policy": name} | count(cfg, policies[name], forest, filtered))
    table = io.StringIO(newline="")
    writer = csv.DictWriter(table, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    atomic_write(folder / "collisions.csv", table.getvalue())
    for name, filtered in itertools.product(policies, ("on", "off")):
        chosen = [row for row in rows if row["policy"] == name and row["filter"] == filtered]
        steps, hits = (sum(row[key] for row in chosen) for key in ("steps", "collisions"))
        print(f"{name:<8} filter {filtered:<4} {steps:>10,} steps  {hits:>9,} collisions")
    print(f"\nresults: {folder / 'collisions.csv'}")
    return sum(row["collisions"] for row in rows if row["filter"] == "on")
