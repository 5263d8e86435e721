"""ForestRL: safe exploration of cluttered forests with graph attention and reinforcement learning.

Importing the package imports nothing else; start from :mod:`forestrl.functional` for the paper's
equations, :mod:`forestrl.envs` for the environment, or ``forestrl --help`` for the commands.
"""


def __getattr__(name: str) -> str:
    """Looks the version up when it is asked for: the import for it is slow."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("forestrl")
    except PackageNotFoundError:  # pragma: no cover - a checkout that was never installed
        return "0+unknown"
