"""When one of several episodes in the same arena falls behind."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def falls_behind(curves: Sequence[Sequence[float]], goal: float) -> list[int | None]:
    """Gives the step from which each stays behind the best of the others until its end.

    What is covered past the goal does not count, and an episode that ended stays where it is.

    Args:
        curves: coverage after 0, 1, 2, ... steps of each episode, shares.
        goal: ``rho*``, a share; an episode ends where it is reached.

    Returns:
        a step for each; None for one that is not behind at the end, or that reaches the goal with
        none before it.

    Examples:
        >>> falls_behind([[0.1, 0.3, 0.5, 0.9], [0.1, 0.4, 0.4, 0.6]], goal=0.9)
        [None, 2]
    """
    last = max(map(len, curves))
    level = np.array(
        [np.pad(np.minimum(curve, goal), (0, last - len(curve)), mode="edge") for curve in curves]
    )
    behind = level < level.max(0)
    found: list[int | None] = []
    for row, mine in zip(level, behind, strict=True):
        end = int(np.argmax(row >= goal)) if (row >= goal).any() else last
        ahead = np.flatnonzero(~mine[:end])
        first = int(ahead[-1]) + 1 if len(ahead) else 0
        found.append(first if first < end else None)
    return found
