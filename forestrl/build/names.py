"""How what a node builds is named, with its settings, in a policy file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hydra.utils import get_class
from omegaconf import DictConfig, OmegaConf


def name_of(node: DictConfig, registry: Mapping[str, Callable[..., Any]]) -> str:
    """Gives the name that what a node builds has in a policy file.

    That is its name in the registry or, for a user's own class, where it is imported from.
    """
    target = node["_target_"]
    return next((name for name, known in registry.items() if known is get_class(target)), target)


def settings_of(node: DictConfig, *, learnt: bool = False) -> dict[str, Any]:
    """Gives the arguments in a node.

    Args:
        node: what builds something.
        learnt: leave out those that its class lists as ``adjustable``: another machine or world may
            change them without changing what was learnt.
    """
    settings: Any = OmegaConf.to_container(node, resolve=True)
    target = settings.pop("_target_")
    free = getattr(get_class(target), "adjustable", ()) if learnt else ()
    return {name: value for name, value in settings.items() if name not in free}
