"""Situations drawn as text: ``?`` unknown, ``.`` free, ``T`` tree, ``A`` the agent, on a free cell.

``print(draw(cells, position))`` gives a map back as a drawing.
"""

from __future__ import annotations

import torch
from torch import Tensor

from forestrl.functional import Cell

CODES = {"?": Cell.UNKNOWN, ".": Cell.FREE, "T": Cell.OCCUPIED, "A": Cell.FREE}
LETTERS = {int(Cell.UNKNOWN): "?", int(Cell.FREE): ".", int(Cell.OCCUPIED): "T"}


def rows_of(text: str) -> list[str]:
    """The non-empty lines of a drawing without blanks; all of one length."""
    rows = ["".join(line.split()) for line in text.splitlines() if line.strip()]
    if len({len(row) for row in rows}) != 1:
        raise ValueError(f"a drawing needs rows of one length, got {[len(row) for row in rows]}")
    return rows


def parse_cells(text: str) -> Tensor:
    """A drawing, with or without an agent, as cells ``[H, W]`` uint8."""
    rows = rows_of(text)
    return torch.tensor([[int(CODES[letter]) for letter in row] for row in rows], dtype=torch.uint8)


def situation(text: str) -> tuple[Tensor, Tensor]:
    """A drawing with one agent as cells ``[H, W]`` uint8 and position ``[2]`` int64 (row, col).

    >>> cells, position = situation("A T ?")
    >>> cells.tolist(), position.tolist()
    ([[1, 2, 0]], [0, 0])
    """
    agents = [
        (row, col)
        for row, line in enumerate(rows_of(text))
        for col, letter in enumerate(line)
        if letter == "A"
    ]
    if len(agents) != 1:
        raise ValueError(f"a situation has one agent, this drawing has {len(agents)}")
    return parse_cells(text), torch.tensor(agents[0])


def world(text: str) -> tuple[Tensor, Tensor]:
    """A fully known drawing as trees ``[H, W]`` bool and position ``[2]`` int64 (row, col)."""
    cells, position = situation(text)
    if (cells == Cell.UNKNOWN).any():
        raise ValueError("a world has no unknown cells")
    return cells == Cell.OCCUPIED, position


def draw(cells: Tensor, position: Tensor | None = None) -> str:
    """The drawing of cells ``[H, W]`` and, if given, position ``[2]``; one line a row."""
    rows = [[LETTERS[int(code)] for code in row] for row in cells.tolist()]
    if position is not None:
        row, col = position.tolist()
        rows[row][col] = "A"
    return "\n".join(" ".join(row) for row in rows)
