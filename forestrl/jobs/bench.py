"""How fast training and deciding are: ``forestrl bench``."""

from __future__ import annotations

import itertools
import json
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import torch
from omegaconf import DictConfig, ListConfig, OmegaConf
from torch.utils.benchmark import Compare, Measurement
from torchrl.envs import Transform
from tqdm.auto import tqdm

from forestrl import build
from forestrl.benchmark.machine import describe_machine
from forestrl.benchmark.measuring import known, to_csv
from forestrl.benchmark.run import describe, measure_arenas, measure_one
from forestrl.benchmark.scaling import growth
from forestrl.benchmark.stages import Setup
from forestrl.benchmark.states import explore
from forestrl.command import asked_for, run_folder
from forestrl.planner import CellPlanner
from forestrl.storage import atomic_write

_POOL = 64  # arenas explored of each size; larger batches repeat them
_TRANSFORMS = {"+ filter": "safety", "+ graph": "graph", "+ reward": "reward"}


def resized(cfg: DictConfig, size: Any, num_envs: int, room: int = 1) -> DictConfig:
    """Gives the configuration for other arenas; trunks that are counted in proportion to the area.

    Args:
        cfg: the whole configuration; it is not changed.
        size: side or sides, cells; None for a world that has no such setting.
        num_envs: arenas stepped at once.
        room: for frontiers; the configuration's if that is more.
    """
    changed = cfg.copy()
    OmegaConf.update(changed, "env.num_envs", num_envs)
    if size is not None:
        OmegaConf.update(changed, "env.size", size)
        if "n_trees" in cfg.env:
            n_trees = round(cfg.env.n_trees * _area(size) / _area(cfg.env.size))
            OmegaConf.update(changed, "env.n_trees", n_trees)
    if "max_frontiers" in cfg.graph:
        most = max(room, cfg.graph.max_frontiers)
        OmegaConf.update(changed, "graph.max_frontiers", most)
    return changed


def _area(size: Any) -> int:
    return size**2 if isinstance(size, int) else math.prod(size)


def make_setup(cfg: DictConfig) -> Setup:
    """Builds what one size and number of arenas is measured with."""
    env, networks = build.make_training_env(cfg), build.make_networks(cfg)
    ppo, observe = build.make_ppo(cfg, networks), build.make_observation(cfg)
    divides = cfg.algo.frames_per_batch % cfg.env.num_envs == 0
    outside = type(observe).forward is not Transform.forward  # it works without an env
    return Setup(
        training=env,
        transforms=[name for name, group in _TRANSFORMS.items() if cfg[group].get("_target_")],
        networks=networks,
        ppo=ppo,
        make_collector=partial(build.make_collector, cfg, env, ppo.actor) if divides else None,
        planner=CellPlanner(networks.make_policy(), observe) if outside else None,
    )


def grids(cfg: DictConfig, asked: set[str]) -> tuple[list[Any], list[Any]]:
    """Gives sizes with numbers of arenas: where all is measured, and where steps alone are.

    ``env.size`` and ``env.num_envs`` ask for one, ``env`` for one of both.
    """
    chosen = []
    for name, ours in (("size", "sizes"), ("num_envs", "num_envs")):
        single = name not in cfg.env or ({"env", f"env.{name}"} & asked and ours not in asked)
        chosen.append([cfg.env.get(name)] if single else list(cfg.bench[ours]))
    sizes = [tuple(size) if isinstance(size, ListConfig) else size for size in chosen[0]]
    whole = list(itertools.product(sizes, chosen[1]))
    if not cfg.bench.scaling or "size" not in cfg.env:
        return whole, []
    steps = itertools.product(cfg.bench.scaling_sizes, cfg.bench.scaling_num_envs)
    return whole, [each for each in steps if each not in whole]


def measure(cfg: DictConfig) -> list[Measurement]:
    """Measures all that is asked for, small arenas first, with a bar on a terminal."""
    whole, steps = grids(cfg, asked_for())
    worlds, facts = {}, {}
    for size in dict.fromkeys(size for size, _ in whole + steps):
        changed = resized(cfg, size, _POOL)
        worlds[size] = explore(
            build.make_forest(changed), min(cfg.episode_steps, cfg.env.max_steps)
        )
        facts[size] = {"n_trees": changed.env.get("n_trees"), **describe(worlds[size])}
    jobs: list[tuple[Any, int, Callable[..., list[Measurement]]]] = [
        (size, n, partial(measure_arenas, learning=(size, n) in whole)) for size, n in whole + steps
    ]
    jobs.sort(key=lambda job: facts[job[0]]["rows"] * facts[job[0]]["columns"] * job[1])
    jobs += [(size, 1, measure_one) for size in dict(whole)]
    measured = []
    with tqdm(jobs, disable=not sys.stderr.isatty()) as bar:
        for size, arenas, job in bar:
            about = {**facts[size], "num_envs": arenas}
            bar.set_description(f"{arenas} of {about['rows']} x {about['columns']}")
            setup = make_setup(resized(cfg, size, arenas, about["max_frontiers"]))
            measured += job(setup, worlds[size], about, cfg.bench.seconds)
    return measured


def report(measured: Sequence[Measurement], about: Mapping[str, str]) -> str:
    """Lays out what was measured as plain text.

    Args:
        measured: all of it.
        about: machine, threads, versions and settings.
    """
    tables = Compare(list(measured))
    tables.highlight_warnings()
    head = "\n".join(f"{name:<18}{value}" for name, value in about.items())
    return "\n\n".join([head, str(tables).strip(), *_notes(measured)])


def _notes(measured: Sequence[Measurement]) -> list[str]:
    """Says what the tables do not show: frames per second, tails, ratios and growth."""
    compiled = {(m.label, m.sub_label): m.median for m in measured if m.description == "compiled"}
    notes: dict[str, list[str]] = {}
    for each in measured:
        table, stage, column = each.label, each.sub_label, each.description
        if stage in ("train iteration", "evaluation step"):
            title, note = f"{stage}, frames/s", f"{column}: {1 / each.median:,.0f}"
        elif "percentile_99" in known(each):
            title, note = (
                "99th percentile, us",
                f"{stage} {1e6 * known(each)['percentile_99']:.0f}",
            )
        elif (table, stage) in compiled and column != "compiled":
            gain = each.median / compiled[table, stage]
            title, note = f"compiled beside {column}, times as fast", f"{stage} {gain:.1f}"
        else:
            continue
        notes.setdefault(f"{table}; {title}", []).append(note)
    if grown := growth(measured):
        title = "growth of the time of a frame over that of its work, at most"
        notes[title] = [f"{stage} {value:.2f}" for stage, value in grown.items()]
    return [f"{title}: {', '.join(values)}" for title, values in notes.items()]


def run(cfg: DictConfig) -> None:
    """Measures, writes and prints the tables."""
    folder = run_folder(cfg)
    build.prepare(cfg)
    torch.manual_seed(cfg.seed)
    about = describe_machine() | {"kernel": cfg.model.get("kernel", "-"), "device": cfg.device}
    frames = cfg.algo.frames_per_batch
    if odd := sorted({arenas for _, arenas in grids(cfg, asked_for())[0] if frames % arenas}):
        about["left out"] = f"learning with {odd} arenas: no part of frames_per_batch={frames}"
    measured = measure(cfg)
    text = report(measured, about)
    atomic_write(folder / "bench.csv", to_csv(measured))
    atomic_write(folder / "machine.json", json.dumps(about, indent=2) + "\n")
    atomic_write(folder / "bench.txt", text + "\n")
    print(f"{text}\n\nresults: {folder}")
