"""A policy measured on test arenas: ``forestrl eval``."""

from __future__ import annotations

import shlex
import sys
from functools import partial
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf
from tqdm.auto import tqdm

from forestrl import __version__, build, records
from forestrl.command import asked_for, configuration, keep, run_folder
from forestrl.evaluation.episodes import Episodes, evaluate
from forestrl.evaluation.metrics import eval_metrics
from forestrl.evaluation.parts import Parts
from forestrl.evaluation.picture import Player, draw_episode
from forestrl.evaluation.report import table, write_report
from forestrl.jobs.worlds import say_world
from forestrl.loggers import Logger, NoLogger
from forestrl.paper import coverage_of
from forestrl.stopping import check, saved

_FREE = ("logger", "threads", "debug", "device")


def explore(cfg: DictConfig, policy: Any, parts: Parts) -> Episodes:
    """Runs a policy on the test arenas of a configuration, with a bar in steps of all arenas."""
    settings = cfg.eval
    bar = tqdm(
        total=settings.arenas * settings.steps,
        unit="step",
        unit_scale=True,
        disable=not sys.stderr.isatty(),
    )

    def progress(done: int) -> None:
        check()
        bar.update(done - bar.n)

    with bar:
        return evaluate(
            partial(build.make_env, cfg, policy=policy),
            policy,
            seed=settings.seed,
            indices=range(settings.first, settings.first + settings.arenas),
            steps=settings.steps,
            batch=settings.batch,
            progress=progress,
            parts=parts,
        )


def why_not(name: str) -> str | None:
    """Says why a setting of an evaluation cannot be changed on the way; None if it can."""
    free = any(f"{name}.".startswith(f"{each}.") for each in _FREE)
    return None if free else "what it measured until now was measured without"


def run(cfg: DictConfig) -> float:
    """Evaluates ``cfg.policy``; returns the mean coverage at the end, for sweepers."""
    folder = run_folder(cfg)
    if cfg.resume is not None and (done := records.finished(folder)) is not None:
        print(f"{folder}: finished, there is nothing left to do")
        return done["result"]
    cfg = configuration(cfg, folder, why_not)
    asked = {records.setting(word) for word in records.began_with(folder)} | asked_for()
    build.prepare(cfg)
    task = build.as_trained(cfg, asked)
    say_world(task)
    policy, about = build.make_policy(task, asked)
    keep(cfg, folder)
    cfg = task
    logger = build.make_logger(cfg, folder)
    failed = True
    try:
        episodes, summary = report(cfg, policy, about, folder)
        if not isinstance(logger, NoLogger):
            log(cfg, policy, logger, folder, episodes, summary)
        failed = False
    finally:
        saved()
        logger.close(failed)
    print(table(summary))
    print(f"\nresults: {folder}")
    return float(episodes.coverage[:, -1].mean())


def report(
    cfg: DictConfig, policy: Any, about: dict[str, Any], folder: Path
) -> tuple[Episodes, dict[str, Any]]:
    """Runs the policy and writes the report; returns the episodes and their summary."""
    settings = {
        **about,
        "env": OmegaConf.to_container(cfg.env, resolve=True),
        "graph": OmegaConf.to_container(cfg.graph, resolve=True),
        "eval": OmegaConf.to_container(cfg.eval, resolve=True),
        "filter": cfg.safety.get("_target_") is not None,
    }
    parts = Parts(folder / "parts", settings)
    episodes = explore(cfg, policy, parts)
    command = shlex.join(["forestrl", "eval", *records.began_with(folder)])
    meta = {**settings, "version": __version__, "command": command}
    paper = coverage_of(about["policy"], cfg.policy.get("variant"), cfg.env)
    summary = write_report(episodes, folder, title=about["policy"], meta=meta, paper=paper)
    parts.clear()
    return episodes, summary


def log(
    cfg: DictConfig,
    policy: Any,
    logger: Logger,
    folder: Path,
    episodes: Episodes,
    summary: dict[str, Any],
) -> None:
    """Sends the report to a dashboard, with an episode in the first arena."""
    settings, picture = cfg.eval, folder / "episode.gif"
    rows = {row["measure"]: row for row in summary["measures"]}
    end = rows[f"coverage_{settings.steps}"]
    interval = {f"eval/coverage_{side}": end[side] for side in ("low", "high")}
    known = {name: value for name, value in interval.items() if value is not None}
    logger.log_metrics(eval_metrics(episodes) | known, step=0)
    logger.log_figure("eval/coverage_curve", folder / "coverage.png", step=0)
    if (folder / "interventions.png").is_file():
        logger.log_figure("eval/interventions", folder / "interventions.png", step=0)
    logger.log_table("eval/episodes", folder / "episodes.csv")
    draw_episode(
        {cfg.policy.name: Player(build.make_env(cfg, 1, policy), policy)},
        picture,
        seed=settings.seed,
        arena=settings.first,
        steps=min(settings.steps, 500),
        every=5,
    )
    logger.log_figure("eval/episode", picture, step=0)
