"""A search to its end: ``forestrl train experiment=linear`` or ``experiment=explorer``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from hydra.utils import get_class, instantiate
from omegaconf import DictConfig, OmegaConf
from torch import nn

from forestrl import build, records
from forestrl.command import keep, typed
from forestrl.evaluation.arenas import draw_arenas
from forestrl.explorer.training.task import Arenas, Search, Task
from forestrl.loggers.csv import METRICS_FILE, read_rows
from forestrl.policies.files import POLICY_FILE, save_policy
from forestrl.progress import Progress
from forestrl.stopping import check, saved

_OF_PPO = (
    *("total_frames", "episode_steps", "checkpoint_every", "eval.every", "eval.steps"),
    *("reward", "graph", "safety", "ablation", "env.num_envs", "env.max_steps"),
)
_FREE = ("logger", "threads", "debug", "device", "algo.generations")


def is_search(cfg: DictConfig) -> bool:
    """Tells whether a configuration's ``algo`` plays whole episodes, and is no PPO."""
    return hasattr(get_class(cfg.algo["_target_"]), "run")


def why_not(name: str) -> str | None:
    """Says why a setting of a search cannot be changed on the way; None if it can."""
    free = any(f"{name}.".startswith(f"{each}.") for each in _FREE)
    return None if free else "what it found until now was found without"


def run(cfg: DictConfig, folder: Path) -> float:
    """Searches to the end; returns the mean steps on the validation arenas, negated, for sweepers.

    A search that goes on finds in its folder what it did before, and logs only what is new.

    Raises:
        ValueError: if a setting was asked for that only PPO reads.
    """
    for name in map(records.setting, records.began_with(folder)):
        if any(f"{name}.".startswith(f"{each}.") for each in _OF_PPO):
            raise ValueError(f"{name} is not read by this algo: it is for algo=ppo")
    search: Search = instantiate(cfg.algo)
    logged, seconds, steps = _logged(folder)
    done = records.finished(folder)
    if done is not None and logged >= search.total:
        print(f"{folder}: finished, there is nothing left to do")
        return done["result"]
    build.prepare(cfg)
    keep(cfg, folder)
    network = instantiate(cfg.model)
    logger, failed = build.make_logger(cfg, folder, logged), True
    began = time.monotonic() - seconds
    try:
        with Progress(search.total, unit=search.unit) as bar:
            for told in search.run(network, make_task(cfg), folder):
                check()
                if told.metrics and (told.done > logged or not logged):
                    metrics = told.metrics | {"time/seconds": time.monotonic() - began}
                    logger.log_metrics(metrics, step=told.done)
                    steps = metrics.get("eval/steps", steps)
                bar.update(told.done, told.metrics)
                if told.network is not None:
                    save(cfg, told.network, told.done, folder / "checkpoints" / "best", logger)
        failed = False
    finally:
        saved()
        logger.close(failed)
    print(f"  steps  {steps:.1f} on the validation arenas, of the last that was measured")
    print(f"\nnext: forestrl eval {typed('checkpoint', folder)}")
    return -steps


def _logged(folder: Path) -> tuple[int, float, float]:
    """How much of a search was logged before, the seconds it took, and the last steps measured."""
    if not (folder / METRICS_FILE).is_file():
        return 0, 0.0, float("nan")
    _, rows, _ = read_rows(folder / METRICS_FILE)
    looks = [float(row["eval/steps"]) for row in rows if row.get("eval/steps")]
    last = rows[-1] if rows else {}
    return (
        int(last.get("frames", 0)),
        float(last.get("time/seconds") or 0),
        looks[-1] if looks else float("nan"),
    )


def make_task(cfg: DictConfig) -> Task:
    """Builds what is to be solved, with the validation arenas."""
    forest = build.make_forest(cfg, 1)
    drawn = draw_arenas(forest, cfg.eval.seed, range(cfg.eval.arenas))
    trees, starts = (drawn[key].numpy() for key in (("arena", "trees"), ("agent", "position")))
    return Task(
        forest.world, forest.lidar_range, cfg.env.coverage_goal, cfg.seed, Arenas(trees, starts)
    )


def save(cfg: DictConfig, network: nn.Module, done: int, folder: Path, logger: Any) -> None:
    """Writes the policy and tells the logger."""
    folder.mkdir(parents=True, exist_ok=True)
    algo: Any = OmegaConf.to_container(cfg.algo, resolve=True)
    about = {"done": done, "seed": cfg.seed, "algo": algo}
    save_policy(folder / POLICY_FILE, build.to_policy(cfg, network, about, reads_graph=False))
    logger.log_policy(folder / POLICY_FILE, ["best"])
