"""The policy to evaluate or draw, and the task it was trained on."""

from __future__ import annotations

import hashlib
import inspect
from typing import Any

from hydra.utils import get_class, get_object, instantiate
from omegaconf import DictConfig, OmegaConf

from forestrl.build.names import name_of
from forestrl.build.networks import NOT_OF_THE_TASK
from forestrl.envs import WORLDS
from forestrl.policies.files import CheckpointError, load_policy, require_same
from forestrl.released import MODELS, policy_file


def make_policy(cfg: DictConfig, asked: set[str]) -> tuple[Any, dict[str, Any]]:
    """Builds the policy to evaluate or draw, and describes it.

    A learned policy brings its own model and observation; a setting that was asked for on the
    command line and differs from the policy's own is refused.

    Args:
        cfg: the whole configuration.
        asked: names of the settings given on the command line.
    """
    node = {name: value for name, value in cfg.policy.items() if name != "name"}
    options = {name: value for name, value in node.items() if name != "_target_"}
    if "models" not in inspect.signature(get_object(node["_target_"])).parameters:
        return instantiate(node), {"policy": cfg.policy.name, "options": options}
    model = get_class(cfg.model["_target_"])
    models = {**MODELS, name_of(cfg.model, MODELS): model}
    path = policy_file(cfg.policy.checkpoint, cfg.policy.released)
    free = adjusted(cfg, models.get(load_policy(path).model.name))
    policy = instantiate(node, models=models, settings=free).to(cfg.device)
    names = (name for name in asked if name.startswith(("model.", "graph.")))
    require_same(policy.file, {name: OmegaConf.select(cfg, name) for name in names})
    return policy, {
        "policy": cfg.policy.name,
        "checkpoint": cfg.policy.checkpoint or "released",
        "training": policy.file.training,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "actions": "mode" if policy.deterministic else "sampled",
    }


def adjusted(cfg: DictConfig, model: Any) -> dict[str, Any]:
    """Gives the settings that a model takes from here and not from its file."""
    nodes = (cfg.model, cfg.env)
    return {
        name: next(node[name] for node in nodes if name in node)
        for name in getattr(model, "adjustable", ())
        if any(name in node for node in nodes)
    }


def as_trained(cfg: DictConfig, asked: set[str]) -> DictConfig:
    """Gives the configuration with the task that the policy to evaluate was trained on.

    What was asked for on the command line stays.

    Args:
        cfg: the whole configuration; it is not changed.
        asked: names of the settings given on the command line.

    Raises:
        CheckpointError: if the policy was trained in a world that is not known here.
    """
    if cfg.policy.get("checkpoint") is None or "env" in asked:
        return cfg
    training = load_policy(cfg.policy.checkpoint).training
    changed, world = cfg.copy(), training.get("world", {"name": "random_forest", "settings": {}})
    here = name_of(cfg.env.world, WORLDS)
    if world["name"] != here:
        if world["name"] not in WORLDS:
            raise CheckpointError(
                f"checkpoint={cfg.policy.checkpoint} was trained in {world['name']!r}, not in "
                f"{here!r}: say with env= in which world it is to be evaluated"
            )
        known = WORLDS[world["name"]]
        node = {"_target_": f"{known.__module__}.{known.__qualname__}", **world["settings"]}
        OmegaConf.update(changed, "env.world", node, merge=False)
    for name, value in training.get("env", {}).items():
        if name in cfg.env and name not in NOT_OF_THE_TASK and f"env.{name}" not in asked:
            OmegaConf.update(changed, f"env.{name}", value)
    if not training.get("filter", True) and "safety" not in asked:
        OmegaConf.update(changed, "safety", {"_target_": None}, merge=False)
    return changed
