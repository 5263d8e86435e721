"""States to test on: random maps, maps a robot could have, and stacks of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from hypothesis import strategies as st
from torch import Tensor

from forestrl.functional import Cell
from tests import oracles

BATCHES = [(), (3,), (2, 3)]


def seeded(seed: int) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def cells_of(mask: Tensor) -> set[tuple[int, int]]:
    """The True cells of a mask ``[H, W]``."""
    return {(row, col) for row, col in mask.nonzero().tolist()}


def mask_of(cells: set[tuple[int, int]], like: Tensor) -> Tensor:
    """The mask, of the shape of ``like``, that is True in ``cells``."""
    mask = torch.zeros_like(like, dtype=torch.bool)
    for row, col in cells:
        mask[row, col] = True
    return mask


def at(position: Tensor) -> tuple[int, int]:
    row, col = position.tolist()
    return row, col


def random_state(
    seed: int, batch: tuple[int, ...] = (), *, height: int = 11, width: int = 11
) -> tuple[Tensor, Tensor]:
    """Cells drawn one by one, and a position; only the position's cell is sure to be free."""
    rng = seeded(seed)
    weights = torch.tensor([0.3, 0.5, 0.2])
    count = torch.Size(batch).numel()
    cells = torch.multinomial(weights, count * height * width, replacement=True, generator=rng)
    cells = cells.reshape(count, height, width).to(torch.uint8)
    rows = torch.randint(height, (count,), generator=rng)
    cols = torch.randint(width, (count,), generator=rng)
    cells[torch.arange(count), rows, cols] = int(Cell.FREE)
    position = torch.stack([rows, cols], -1)
    return cells.reshape(*batch, height, width), position.reshape(*batch, 2)


def explored_state(
    seed: int, *, size: int = 13, density: float = 0.12, lidar_range: float = 4.0
) -> tuple[Tensor, Tensor, Tensor]:
    """Trees, what a robot knows of them after scans from four places, and the last place."""
    rng = seeded(seed)
    trees = torch.rand(size, size, generator=rng) < density
    start = tuple(torch.randint(size, (2,), generator=rng).tolist())
    trees[start] = False
    reach = sorted(oracles.component((~trees).tolist(), start))
    cells = torch.zeros(size, size, dtype=torch.uint8)
    for _ in range(4):
        place = reach[int(torch.randint(len(reach), (), generator=rng))]
        for row, col in oracles.scan(trees.tolist(), place, lidar_range):
            cells[row, col] = int(Cell.OCCUPIED if trees[row, col] else Cell.FREE)
    return trees, cells, torch.tensor(place)


def explored_states(seed: int, batch: tuple[int, ...], **options: Any) -> tuple[Tensor, ...]:
    """A stack of explored states: trees, cells, position, each with leading dims ``batch``."""
    count = torch.Size(batch).numel()
    singles = [explored_state(100 * seed + i, **options) for i in range(count)]
    stacks = [torch.stack(parts) for parts in zip(*singles, strict=True)]
    return tuple(stack.reshape(*batch, *stack.shape[1:]) for stack in stacks)


@st.composite
def masks(draw: st.DrawFn, max_side: int = 7, square: bool = False) -> Tensor:
    """Boolean grids ``[H, W]`` of 2 to ``max_side`` cells a side."""
    height = draw(st.integers(2, max_side))
    width = height if square else draw(st.integers(2, max_side))
    bits = draw(st.lists(st.booleans(), min_size=height * width, max_size=height * width))
    return torch.tensor(bits).reshape(height, width)


@st.composite
def maps(draw: st.DrawFn, max_side: int = 7, square: bool = False) -> tuple[Tensor, Tensor]:
    """Agent's maps ``[H, W]`` uint8 with the agent on a free cell."""
    height = draw(st.integers(2, max_side))
    width = height if square else draw(st.integers(2, max_side))
    codes = draw(st.lists(st.integers(0, 2), min_size=height * width, max_size=height * width))
    cells = torch.tensor(codes, dtype=torch.uint8).reshape(height, width)
    row, col = draw(st.integers(0, height - 1)), draw(st.integers(0, width - 1))
    cells[row, col] = int(Cell.FREE)
    return cells, torch.tensor([row, col])


@st.composite
def worlds(draw: st.DrawFn, max_side: int = 9) -> tuple[Tensor, Tensor]:
    """Trees ``[H, W]`` bool with the agent on a free cell."""
    trees = draw(masks(max_side)).clone()
    row, col = draw(st.integers(0, len(trees) - 1)), draw(st.integers(0, len(trees[0]) - 1))
    trees[row, col] = False
    return trees, torch.tensor([row, col])


def tensors_of(result: Any) -> tuple[Tensor, ...]:
    return (result,) if isinstance(result, Tensor) else tuple(result)


def columns_first(x: Tensor) -> Tensor:
    """The same values, with the strides of the last two dims swapped, as a turned grid has."""
    return x.mT.contiguous().mT if x.ndim > 1 else x


def assert_batched_equals_singles(
    function: Callable[..., Any], *inputs: Tensor, batch: tuple[int, ...]
) -> None:
    """``function`` of a stack is the stack of ``function`` of each; shapes and dtypes too.

    Nor does it matter how the stack lies in memory.
    """
    batched = tensors_of(function(*inputs))
    strided = tensors_of(function(*map(columns_first, inputs)))
    if not batch:  # the other way round: one state is a stack of one
        stack_of_one = tensors_of(function(*(x.unsqueeze(0) for x in inputs)))
        expected = [result.squeeze(0) for result in stack_of_one]
    else:
        flat = [x.reshape(-1, *x.shape[len(batch) :]) for x in inputs]
        singles = [tensors_of(function(*row)) for row in zip(*flat, strict=True)]
        stacks = [torch.stack(parts) for parts in zip(*singles, strict=True)]
        expected = [stack.reshape(*batch, *stack.shape[1:]) for stack in stacks]
    for result, same, wanted in zip(batched, strided, expected, strict=True):
        torch.testing.assert_close(result, wanted, rtol=0, atol=1e-6)
        torch.testing.assert_close(same, wanted, rtol=0, atol=1e-6)


def turned(grid: Tensor) -> Tensor:
    """A grid ``[..., H, W]`` turned a quarter, counterclockwise."""
    return torch.rot90(grid, 1, (-2, -1))


def turned_position(position: Tensor, width: int) -> Tensor:
    """Where ``position`` lies in the turned grid; ``width`` is that of the grid before."""
    row, col = position.unbind(-1)
    return torch.stack([width - 1 - col, row], -1)
