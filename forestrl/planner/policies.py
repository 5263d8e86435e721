"""The policies that a planner may be asked for by name, or by file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import forestrl.policies
from forestrl.explorer import LinearScore, ViewpointGATv2
from forestrl.planner.cells import Module
from forestrl.planners import (
    CostBased,
    InformationGain,
    NearestFrontier,
    PathGain,
    PotentialField,
    RandomWalk,
)
from forestrl.policies.files import Policy, load_policy
from forestrl.settings import not_allowed
from forestrl.wording import nearest

MakePolicy = Callable[[float], tuple[Module, Module | None]]
"""From the sensor's range in cells to a policy, and what it reads besides the map."""

CLASSICAL: Mapping[str, Callable[[float], Module]] = MappingProxyType(
    {
        "nearest_frontier": lambda lidar_range: NearestFrontier(),
        "information_gain": lambda lidar_range: InformationGain(),
        "information_gain_tuned": lambda lidar_range: InformationGain(5, 0.7),
        "path_gain": PathGain,
        "cost": lambda lidar_range: CostBased("corrected"),
        "mmpf": lambda lidar_range: PotentialField("corrected"),
        "random": lambda lidar_range: RandomWalk(),
    }
)
"""The classical planners that a robot can run: those that read their own map alone."""
RELEASED: Mapping[str, str] = MappingProxyType(
    {"learned": "explorer", "linear": "linear", "paper": "paper"}
)
"""The policies that come with the package, and the names of their files."""
_EXPLORERS: Mapping[str, Callable[..., LinearScore | ViewpointGATv2]] = MappingProxyType(
    {"linear_score": LinearScore, "viewpoint_gatv2": ViewpointGATv2}
)
_ASSETS = Path(forestrl.policies.__file__).parent / "assets"


def policy_named(name: str, deterministic: bool | None = None) -> MakePolicy:
    """Finds a policy.

    Args:
        name: of a classical planner or a released policy, or a policy file or run folder.
        deterministic: take the most probable action instead of a sampled one; None for what the
            policy is meant for.

    Raises:
        CheckpointError: if there is no such file, or it is no policy.
        ValueError: if there is no such name.
    """
    if name in CLASSICAL:
        return lambda lidar_range: (CLASSICAL[name](lidar_range), None)
    if name not in RELEASED and not Path(name).exists():
        names = [*CLASSICAL, *RELEASED]
        raise not_allowed(
            "policy",
            name,
            f"it must be one of {', '.join(names)}, a policy file or a run folder"
            + nearest(name, names),
        )
    path = _ASSETS / f"{RELEASED[name]}.safetensors" if name in RELEASED else Path(name)
    file = load_policy(path)
    if file.model.name in _EXPLORERS:
        return lambda lidar_range: (
            file.build(_EXPLORERS, lidar_range=lidar_range).make_policy(deterministic),
            None,
        )
    return _of_torchrl(file, deterministic)


def _of_torchrl(file: Policy, deterministic: bool | None) -> MakePolicy:
    """Makes the policies that are parts of TorchRL, as the paper's is."""
    from forestrl.envs import OBSERVATIONS  # here, as no other policy needs TorchRL
    from forestrl.policies.files import CheckpointError
    from forestrl.released import MODELS

    reads = file.observation
    if reads is not None and reads.name not in OBSERVATIONS:
        raise CheckpointError(
            f"{file.source} reads {reads.name!r}, which is not one of {', '.join(OBSERVATIONS)}: "
            "build policy and observation yourself and give Planner a function that makes them"
        )

    def make(lidar_range: float) -> tuple[Module, Module | None]:
        networks = file.build(MODELS, lidar_range=lidar_range)
        settings = {} if reads is None else {**reads.settings, "lidar_range": lidar_range}
        observe = None if reads is None else OBSERVATIONS[reads.name](**settings)
        return networks.make_policy(deterministic), observe

    return make
