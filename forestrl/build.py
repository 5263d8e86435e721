"""Configuration to objects: the only assembler."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path
from typing import Any

import torch
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from tensordict.nn import TensorDictModuleBase
from torchrl.collectors import Collector
from torchrl.envs import Compose, EnvBase, RewardSum, TransformedEnv

from forestrl.envs import StaggeredEpisodes
from forestrl.kernels.sensing import are_compiled
from forestrl.loggers import CsvLogger, Logger, Loggers, NoLogger, TensorboardLogger, WandbLogger
from forestrl.policies.actor_critic import ActorCritic
from forestrl.policies.files import RELEASED, Policy, find_policy, load_policy, require_same

_ARCHITECTURE = ("hidden", "heads", "critic_readout", "lidar_range", "edge_lengths")


class ConfigError(ValueError):
    """A setting that is not allowed; the message names it, its value and what is allowed."""


def prepare(cfg: DictConfig) -> None:
    """Sets threads and checks the device, before anything is built."""
    require_positive(cfg, "threads")
    if cfg.seed < 0:
        raise ConfigError(f"seed={cfg.seed} is not allowed: it must be 0 or more")
    torch.set_num_threads(cfg.threads)
    if not are_compiled():
        print("compiling for this machine: half a minute, the first time only", file=sys.stderr)
    try:
        torch.zeros(1, device=cfg.device)
    except (RuntimeError, AssertionError) as error:
        there = ["cpu", *(f"cuda:{i}" for i in range(torch.cuda.device_count()))]
        raise ConfigError(
            f"device={cfg.device} is not there: this machine has {', '.join(there)}"
        ) from error


def require_positive(cfg: DictConfig, *names: str) -> None:
    """Refuses settings less than 1."""
    for name in names:
        if (value := OmegaConf.select(cfg, name)) < 1:
            raise ConfigError(f"{name}={value} is not allowed: at least 1 is needed")


def make_output_folder(folder: Path) -> Path:
    """Makes a folder for results and checks that it can be written to."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".writable-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise ConfigError(f"the output folder {folder} cannot be written: {error}") from error
    return folder


def make_env(cfg: DictConfig, num_envs: int | None = None) -> TransformedEnv:
    """Builds the env as evaluation sees it: forest, filter and graph.

    Args:
        cfg: the whole configuration.
        num_envs: arenas stepped at once; by default the configuration's.
    """
    env = instantiate(cfg.env, num_envs=num_envs or cfg.env.num_envs)
    return _transformed(env, (cfg.safety, cfg.graph))


def make_training_env(cfg: DictConfig) -> TransformedEnv:
    """Builds the env as training sees it: filter, graph, reward, and staggered short episodes."""
    env = _transformed(instantiate(cfg.env), (cfg.safety, cfg.graph, cfg.reward))
    env.append_transform(StaggeredEpisodes(cfg.episode_steps, seed=cfg.seed))
    env.append_transform(RewardSum())
    return env


def _transformed(env: EnvBase, nodes: tuple[DictConfig, ...]) -> TransformedEnv:
    """Puts the transforms around an env, in the order written."""
    chosen = [instantiate(node) for node in nodes if node.get("_target_") is not None]
    return TransformedEnv(env, Compose(*chosen))


def make_collector(cfg: DictConfig, env: TransformedEnv, actor: TensorDictModuleBase) -> Collector:
    """Builds the collector: endless batches of ``frames_per_batch`` frames over all arenas."""
    frames, arenas = cfg.algo.frames_per_batch, cfg.env.num_envs
    if frames % arenas:
        raise ConfigError(
            f"env.num_envs={arenas} is not allowed: it must divide algo.frames_per_batch={frames}"
        )
    return Collector(
        env, actor, frames_per_batch=frames, total_frames=-1, auto_register_policy_transforms=False
    )


def make_networks(cfg: DictConfig) -> ActorCritic:
    """Builds actor and critic, freshly initialised."""
    return instantiate(cfg.model).to(cfg.device)


def architecture(cfg: DictConfig) -> dict[str, Any]:
    """Gives the part of the configuration that a policy file repeats."""
    return {name: cfg.model[name] for name in _ARCHITECTURE}


def to_policy(cfg: DictConfig, networks: ActorCritic, training: dict[str, Any]) -> Policy:
    """Gives networks the description that their policy file needs."""
    return Policy(architecture(cfg), cfg.graph.window, training, networks.state_dict())


def make_policy(cfg: DictConfig, asked: set[str]) -> tuple[TensorDictModuleBase, dict[str, Any]]:
    """Builds the policy to evaluate or draw, and describes it.

    A learned policy brings its own model and window; a setting that was asked for on the command
    line and differs from the policy's own is refused. Its unit of length is the world's own ``l``.

    Args:
        cfg: the whole configuration; ``graph.window`` is set to a learned policy's own.
        asked: names of the settings given on the command line.
    """
    if cfg.policy.name != "learned":
        settings = {key: value for key, value in cfg.policy.items() if key != "name"}
        options = {key: value for key, value in settings.items() if key != "_target_"}
        return instantiate(settings), {"policy": cfg.policy.name, "options": options}
    path = Path(str(cfg.checkpoint)) if cfg.checkpoint is not None else RELEASED
    policy = load_policy(path)
    wanted = {**architecture(cfg), "window": cfg.graph.window}
    groups = {name: "graph.window" if name == "window" else f"model.{name}" for name in wanted}
    require_same(policy, {n: v for n, v in wanted.items() if groups[n] in asked}, str(path))
    cfg.graph.window = policy.window
    networks = policy.build(cfg.model.kernel, cfg.env.lidar_range).to(cfg.device)
    name = "released" if cfg.checkpoint is None else str(path)
    about = {"policy": "learned", "checkpoint": name, "training": policy.training}
    about["sha256"] = hashlib.sha256(find_policy(path).read_bytes()).hexdigest()
    about["actions"] = "mode" if cfg.policy.deterministic else "sampled"
    return networks.make_policy(cfg.policy.deterministic), about


def make_logger(
    cfg: DictConfig, run_dir: Path, frames: int = 0, logger_id: str | None = None
) -> Logger:
    """Builds the logger; a CSV file is written beside every other one.

    Args:
        cfg: the whole configuration.
        run_dir: the run folder.
        frames: frames the run goes on from.
        logger_id: the dashboard's id of the run that goes on.
    """
    if cfg.logger.name == "none":
        return NoLogger()
    loggers: list[Logger] = [CsvLogger(run_dir / "metrics.csv", frames)]
    if cfg.logger.name == "tensorboard":
        loggers.append(TensorboardLogger(run_dir / "tensorboard"))
    elif cfg.logger.name == "wandb":
        loggers.append(_make_wandb(cfg, run_dir, logger_id))
    return Loggers(*loggers)


def _make_wandb(cfg: DictConfig, run_dir: Path, logger_id: str | None) -> WandbLogger:
    """Starts a W&B run named after its overrides; the jobs of a sweep share one folder."""
    job = HydraConfig.get()
    sweep = Path(job.sweep.dir) if job.mode is not None and job.mode.name == "MULTIRUN" else None
    overrides = list(job.overrides.task)
    folder = Path(cfg.logger.dir) if cfg.logger.dir else sweep or run_dir
    config: Any = OmegaConf.to_container(cfg, resolve=True)
    return WandbLogger(
        folder,
        config,
        project=cfg.logger.project,
        entity=cfg.logger.entity,
        group=cfg.logger.group or (sweep.name if sweep else job.runtime.choices.get("experiment")),
        job_type=job.job.name,
        name=",".join(overrides)[:120] or None,
        tags=[override[:64] for override in overrides],
        id=logger_id,
        resume="allow" if logger_id else None,
    )
