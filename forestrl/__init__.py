"""ForestRL: safe exploration of cluttered forests with graph attention and reinforcement learning.

Importing the package imports nothing else; start from :mod:`forestrl.functional` for the paper's
equations, :mod:`forestrl.envs` for the environment, or ``forestrl --help`` for the commands.
"""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("forestrl")
except PackageNotFoundError:  # pragma: no cover - a checkout that was never installed
    __version__ = "0+unknown"
