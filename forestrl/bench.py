"""Measures how fast training and deciding are: ``python -m forestrl.bench model.kernel=pyg``."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import torch
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from torchrl.collectors import Collector
from torchrl.envs import Compose, TransformedEnv
from tqdm.auto import tqdm

from forestrl import build
from forestrl.benchmark.compiled import measure_compiled, write_compiled
from forestrl.benchmark.machine import describe_machine
from forestrl.benchmark.report import write_report
from forestrl.benchmark.run import Makers, explore_all, run
from forestrl.benchmark.scaling import measure_scaling, write_scaling
from forestrl.benchmark.stages import Parts
from forestrl.command import asked_for, command
from forestrl.envs import ForestEnv

_STAGES = {"+ filter": "safety", "+ graph": "graph", "+ reward": "reward"}


def resized(cfg: DictConfig, size: int, num_envs: int, max_frontiers: int = 1) -> DictConfig:
    """Gives the configuration for another arena side, with trunks in proportion to the area."""
    n_trees = round(cfg.env.n_trees * size**2 / cfg.env.size**2)
    changed = cfg.copy()
    OmegaConf.update(changed, "env", {"size": size, "n_trees": n_trees, "num_envs": num_envs})
    OmegaConf.update(changed, "graph.max_frontiers", max_frontiers)
    return changed


def make_forest(cfg: DictConfig, size: int, num_envs: int) -> ForestEnv:
    """Builds the bare forest."""
    return instantiate(resized(cfg, size, num_envs).env)


def make_parts(cfg: DictConfig, size: int, num_envs: int, max_frontiers: int) -> Parts:
    """Builds what one size and number of arenas is measured with."""
    cfg = resized(cfg, size, num_envs, max_frontiers)
    chosen = {stage: cfg[group] for stage, group in _STAGES.items() if cfg[group].get("_target_")}
    nodes = list(chosen.values())
    envs = {"env step": instantiate(cfg.env)}
    for count, stage in enumerate(chosen, 1):
        transforms = Compose(*map(instantiate, nodes[:count]))
        envs[stage] = TransformedEnv(instantiate(cfg.env), transforms)
    networks = build.make_networks(cfg)
    ppo = instantiate(cfg.algo, networks.make_actor(), networks.make_critic())

    def make_collector() -> Collector:
        return build.make_collector(cfg, build.make_training_env(cfg), ppo.actor)

    divides = cfg.algo.frames_per_batch % num_envs == 0
    return Parts(envs, build.make_env(cfg), networks, ppo, make_collector if divides else None)


def cells(cfg: DictConfig, asked: set[str]) -> tuple[list[int], list[int]]:
    """Gives arena sides and numbers of arenas; ``env.size`` and ``env.num_envs`` ask for one."""
    chosen = []
    for name, ours in (("size", "sizes"), ("num_envs", "num_envs")):
        single = {"env", f"env.{name}"} & asked and f"bench.{ours}" not in asked
        chosen.append([cfg.env[name]] if single else list(cfg.bench[ours]))
    return chosen[0], chosen[1]


def check(cfg: DictConfig) -> None:
    """Refuses settings that nothing can be measured with, before anything is."""
    build.require_positive(cfg, "episode_steps")
    if cfg.bench.seconds <= 0:
        raise build.ConfigError(
            f"bench.seconds={cfg.bench.seconds} is not allowed: it must be more than 0"
        )
    for name in ("num_envs", "sizes", "scaling_num_envs", "scaling_sizes"):
        values = cfg.bench[name]
        smallest = 3 if "sizes" in name else 1
        if not values or min(values) < smallest:
            raise build.ConfigError(
                f"bench.{name}={values} is not allowed: one or more numbers of at least "
                f"{smallest} are needed"
            )


def measure(cfg: DictConfig, folder: Path) -> list[str]:
    """Measures all that is asked for, with a bar on a terminal; returns the tables."""
    settings, (sizes, num_envs) = cfg.bench, cells(cfg, asked_for())
    makers = Makers(
        forest=partial(make_forest, cfg),
        parts=partial(make_parts, cfg),
        steps=min(cfg.episode_steps, cfg.env.max_steps),
        max_frontiers=cfg.graph.max_frontiers,
        window=cfg.graph.window,
    )
    more = (list(settings.scaling_sizes), list(settings.scaling_num_envs))
    total = len(sizes) * (len(num_envs) + 2) + settings.scaling * len(more[0]) * len(more[1])
    about = describe_machine() | {"kernel": cfg.model.kernel, "device": cfg.device}
    with tqdm(total=total, disable=not sys.stderr.isatty()) as bar:

        def progress(done: str) -> None:
            bar.set_description(done)
            bar.update()

        explored = explore_all(makers, sizes)
        rows = run(makers, explored, num_envs, settings.seconds, progress)
        texts = [write_report(rows, about, folder)]
        gains = measure_compiled(makers, explored, settings.seconds, progress)
        texts.append(write_compiled(gains, folder))
        if settings.scaling:
            costs = measure_scaling(makers, *more, settings.seconds, progress)
            texts.append(write_scaling(costs, folder))
    return texts


@command("bench")
def main(cfg: DictConfig) -> None:
    """Measures, writes and prints the tables."""
    folder = Path(HydraConfig.get().runtime.output_dir)
    build.prepare(cfg)
    check(cfg)
    build.make_output_folder(folder)
    torch.manual_seed(cfg.seed)
    print("\n\n".join([*measure(cfg, folder), f"results: {folder}"]))


if __name__ == "__main__":
    main()
