"""The paper's forests: so many trunks in an arena of cells (Table III)."""

from __future__ import annotations

from typing import Annotated

import torch
from torch import Tensor

from forestrl import functional as F
from forestrl import kernels
from forestrl.envs.worlds.source import ATTEMPTS, Side, arena_shape
from forestrl.settings import Range, checked, not_allowed

Radius = Annotated[float, Range(above=0, high=50)]


class RandomForest:
    """Forests of round trunks: centres and radii uniform, overlaps allowed (Table III).

    The start is a free cell drawn uniformly from the largest 8-connected component of free cells. A
    forest without a free cell is drawn again.

    Args:
        shape: rows and columns, cells; one number for a square arena of side ``h``.
        n_trees: number of trunks ``n_t``.
        tree_radius: smallest and largest trunk radius ``r_t``, cells.

    Raises:
        ValueError: if a value is out of its range; the message names both.

    Examples:
        >>> forest = RandomForest((20, 30), n_trees=5)
        >>> trees, start = forest.sample((4,), generator=torch.Generator())
        >>> trees.shape, start.shape
        (torch.Size([4, 20, 30]), torch.Size([4, 2]))
    """

    @checked
    def __init__(
        self,
        shape: Side | tuple[Side, Side] = 50,
        n_trees: Annotated[int, Range(0, 100_000)] = 45,
        tree_radius: tuple[Radius, Radius] = (1.0, 3.0),
    ) -> None:
        self.shape = arena_shape(shape)
        if tree_radius[0] > tree_radius[1]:
            raise not_allowed("tree_radius", tree_radius, "it must be [smallest, largest]")
        self.n_trees, self.tree_radius = n_trees, (tree_radius[0], tree_radius[1])

    def sample(
        self, batch: tuple[int, ...], *, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Draws forests and starts, see :class:`~forestrl.envs.World`.

        Raises:
            ValueError: if no forest with a free cell turns up.
        """
        trees = self._draw(batch, generator)
        for _ in range(ATTEMPTS):
            full = trees.flatten(-2).all(-1)
            if not full.any():
                return trees, F.sample_position(kernels.largest_component(~trees), generator)
            trees = torch.where(full[..., None, None], self._draw(batch, generator), trees)
        raise ValueError(
            f"n_trees={self.n_trees} of radius {list(self.tree_radius)} leaves no free cell in an "
            f"arena of {self.shape[0]} x {self.shape[1]} cells: take fewer or thinner trees or a "
            "larger arena"
        )

    def _draw(self, batch: tuple[int, ...], generator: torch.Generator) -> Tensor:
        return F.sample_trees(
            batch,
            shape=self.shape,
            n_trees=self.n_trees,
            tree_radius=self.tree_radius,
            generator=generator,
        )
