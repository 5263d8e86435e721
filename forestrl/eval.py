"""Measures a policy on test arenas: ``python -m forestrl.eval policy=nearest_frontier``."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf
from tqdm.auto import tqdm

from forestrl import __version__, build
from forestrl.command import asked_for, command
from forestrl.evaluation.episodes import Episodes, evaluate
from forestrl.evaluation.metrics import eval_metrics
from forestrl.evaluation.report import table, write_report

PAPER_ARENA = {"size": 50, "n_trees": 45}
"""The paper's numbers are drawn into the pictures of evaluations in these arenas only."""


def run(cfg: DictConfig, policy: Any) -> Episodes:
    """Runs a policy on the test arenas of a configuration, with a bar in steps of all arenas."""
    settings = cfg.eval
    build.require_positive(cfg, "eval.arenas", "eval.steps", "eval.batch")
    bar = tqdm(
        total=settings.arenas * settings.steps,
        unit="step",
        unit_scale=True,
        disable=not sys.stderr.isatty(),
    )
    with bar:
        return evaluate(
            lambda arenas: build.make_env(cfg, num_envs=arenas),
            policy,
            seed=settings.seed,
            indices=range(settings.first, settings.first + settings.arenas),
            steps=settings.steps,
            batch=settings.batch,
            progress=lambda done: bar.update(done - bar.n),
        )


@command("eval")
def main(cfg: DictConfig) -> float:
    """Evaluates ``cfg.policy``; returns the mean coverage at the end, for sweepers."""
    folder = Path(HydraConfig.get().runtime.output_dir)
    build.prepare(cfg)
    build.make_output_folder(folder)
    policy, about = build.make_policy(cfg, asked_for())
    episodes = run(cfg, policy)
    meta = {
        **about,
        "version": __version__,
        "command": shlex.join(["forestrl", "eval", *HydraConfig.get().overrides.task]),
        "env": OmegaConf.to_container(cfg.env, resolve=True),
        "eval": OmegaConf.to_container(cfg.eval, resolve=True),
        "filter": cfg.safety.get("_target_") is not None,
    }
    paper = all(cfg.env[name] == value for name, value in PAPER_ARENA.items())
    summary = write_report(episodes, folder, title=about["policy"], meta=meta, paper=paper)
    _log(cfg, folder, episodes)
    print(table(summary))
    print(f"\nresults: {folder}")
    return float(episodes.coverage[:, -1].mean())


def _log(cfg: DictConfig, folder: Path, episodes: Episodes) -> None:
    """Sends the report to a dashboard, if one is asked for."""
    logger = build.make_logger(cfg, folder)
    failed = True
    try:
        logger.log_metrics(eval_metrics(episodes), step=0)
        logger.log_figure("eval/coverage_curve", folder / "coverage.png", step=0)
        logger.log_figure("eval/interventions", folder / "interventions.png", step=0)
        failed = False
    finally:
        logger.close(failed)


if __name__ == "__main__":
    main()
