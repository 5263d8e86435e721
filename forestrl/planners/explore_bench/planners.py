"""Explore-Bench's two planners, as published and corrected.

Kept as published: a frontier cell is an unknown cell beside a free one that has a free neighbour of
its own; clusters by Manhattan distances of at most 2, their order and centres; distances along
4-connected cells, and 0 for what they do not reach; the goal of the cost-based planner in the first
free cell of the 3 x 3 around a centre; the potential field's descent over four neighbours, free or
not, in the order up, left, down, right, with a penalty on cells of the way that is forgotten at the
next step; nothing at all remembered; and A* to the goal in the *true* arena, as if it knew what
lies in unknown cells. Truth is read for that step only.

Not kept, because it belongs to Explore-Bench's simulator: its square LiDAR window and the rounding
that shifts it by a cell, the two outer rows and columns without frontiers, the unknown margin
around the wall, indices beyond the map. Here the planners see our map, and the arena is walled.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import torch
from torch import Tensor

from forestrl import keys as K
from forestrl.planners.base import ClassicalPlanner, Key
from forestrl.planners.explore_bench import corrected, published
from forestrl.settings import checked

Variant = Literal["published", "corrected"]
_GOAL = ("planner", "goal")


class _ExploreBench(ClassicalPlanner):
    """A planner in two variants."""

    _published: Callable[[Tensor, Tensor, Tensor], tuple[Tensor, Tensor]]
    _corrected: Callable[[Tensor, Tensor, Tensor], tuple[Tensor, Tensor, Tensor]]

    @checked
    def __init__(self, variant: Variant) -> None:
        as_published = variant == "published"
        super().__init__(
            reads=[K.TREES] * as_published, remembers=[_GOAL, K.TARGET] * (not as_published)
        )
        self.variant = variant

    def plan(self, entries: dict[Key, Tensor], changed: Tensor) -> tuple[Tensor, Tensor]:
        """Plans one step."""
        cells, position = entries[K.CELLS], entries[K.POSITION]
        if self.variant == "published":
            return self._published(cells, position, entries[K.TREES])
        kept = torch.where(changed.unsqueeze(-1), -1, entries.get(_GOAL, position))
        action, status, entries[_GOAL] = self._corrected(cells, position, kept)
        entries[K.TARGET] = entries[_GOAL]
        return action, status


class CostBased(_ExploreBench):
    """Takes a step towards the cluster of frontier cells at the least distance.

    As published it stops for ever in a cycle of two cells where a pocket is left through a diagonal
    gap: from either side the cells on the other are at distance 0. It also stops where its goal is
    its own cell, and where a narrow gap has no cell that counts as a frontier.

    Corrected, distances are those of the agent's own eight moves, and infinite for what they do not
    reach; where the published rule finds no frontier in reach, every unknown cell with a neighbour
    in reach is one; a goal is kept until a cell becomes known; and A* plans on the agent's own map.

    Args:
        variant: ``published`` reads ``("arena", "trees")``, the truth, for the way to its goal.

    Raises:
        ValueError: if there is no such variant.
    """

    _published, _corrected = staticmethod(published.cost), staticmethod(corrected.cost)

    def __init__(self, variant: Variant = "published") -> None:
        super().__init__(variant)


class PotentialField(_ExploreBench):
    """MMPF: takes a step towards the end of a descent in the potential of all clusters.

    Each cluster attracts with its number of cells over the distance of its centre. As published the
    descent ends in a local minimum, and as nothing is remembered the agent then goes back and forth
    between the minimum and its best neighbour. It also stops where all potentials are 0: its goal
    is then the cell above.

    Corrected as :class:`CostBased` is, and penalties are not forgotten: each visit raises a cell,
    so that the descent fills a minimum until it flows over, and ends beside a centre.

    Args:
        variant: ``published`` reads ``("arena", "trees")``, the truth, for the way to its goal.

    Raises:
        ValueError: if there is no such variant.
    """

    _published, _corrected = staticmethod(published.mmpf), staticmethod(corrected.mmpf)

    def __init__(self, variant: Variant = "published") -> None:
        super().__init__(variant)
