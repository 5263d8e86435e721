"""The policies that play in the same arena: the one chosen, and those beside it."""

from __future__ import annotations

from collections.abc import Sequence

from hydra import compose
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from forestrl import build
from forestrl.command import asked_for
from forestrl.evaluation.picture import Player


def make_players(cfg: DictConfig, beside: Sequence[str] | None) -> dict[str, Player]:
    """Builds ``cfg.policy`` and the policies beside it, each with its env, by name.

    Raises:
        ConfigError: if a policy is named twice.
    """
    names = [cfg.policy.name, *(beside or [])]
    if len(set(names)) < len(names):
        raise build.ConfigError(
            f"beside={beside} is not allowed: each policy is drawn once, and "
            f"{cfg.policy.name} is drawn already"
        )
    players = {}
    for name in names:
        chosen = cfg if name == cfg.policy.name else _with_policy(cfg, name)
        policy, _ = build.make_policy(chosen, asked_for())
        players[name] = Player(build.make_env(chosen, 1, policy), policy)
    return players


def _with_policy(cfg: DictConfig, name: str) -> DictConfig:
    """Gives the configuration with another policy, as ``policy=name`` would choose it."""
    job = HydraConfig.get()
    places = [word for word in job.overrides.hydra if word.startswith("hydra.searchpath=")]
    chosen, changed = compose(job.job.config_name, [*places, f"policy={name}"]), cfg.copy()
    OmegaConf.update(changed, "policy", chosen._get_node("policy"), merge=False)
    return changed
