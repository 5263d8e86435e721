"""What a transform asks the env that it is in."""

from __future__ import annotations

from torchrl.envs.transforms import Transform


def setting_of(transform: Transform, name: str) -> float:
    """Gives a transform's own setting or, where it leaves it open, that of the env it is in.

    Raises:
        ValueError: if it is in no env.
    """
    if (own := getattr(transform, name)) is not None:
        return own
    if (container := transform.container) is None:
        raise ValueError(
            f"{type(transform).__name__} is in no env to take its {name} from: give it"
        )
    env, found = container.base_env, vars(transform).setdefault("_found", {})
    if found.get("env") != id(env):  # asked once: it may be in another process
        value = getattr(env, name)
        found["env"], found[name] = id(env), value[0] if isinstance(value, list) else value
    return found[name]
