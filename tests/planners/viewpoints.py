"""Viewpoints, paths and scores as slow loops over plain Python, written from their description."""

from __future__ import annotations

import math

from tests.oracles import FREE, OCCUPIED, UNKNOWN, Cell, Grid, inside

MOVES = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]


class Map:
    """A robot's map with what it asks of it again and again."""

    def __init__(self, cells: Grid, lines):
        self.cells, self.rows, self.cols = cells, len(cells), len(cells[0])
        self.lines = list(zip(lines.offsets.tolist(), lines.between.tolist(), strict=True))
        self.seen = {}

    def unknown(self, cell: Cell) -> bool:
        return inside(self.cells, cell) and self.cells[cell[0]][cell[1]] == UNKNOWN

    def is_free(self, cell: Cell) -> bool:
        return inside(self.cells, cell) and self.cells[cell[0]][cell[1]] == FREE

    def could_see(self, cell: Cell) -> set[Cell]:
        """S(v): unknown cells in range that no known trunk hides."""
        if cell not in self.seen:
            self.seen[cell] = {
                target
                for (dr, dc), between in self.lines
                if self.unknown(target := (cell[0] + dr, cell[1] + dc))
                and not any(
                    self.cells[cell[0] + r][cell[1] + c] == OCCUPIED
                    for r, c in between
                    if (r, c) != (0, 0)
                )
            }
        return self.seen[cell]

    def share_unknown(self, cell: Cell, reach: int, without=frozenset()) -> float:
        rows, cols = (range(x - reach, x + reach + 1) for x in cell)
        count = sum(self.unknown((r, c)) and (r, c) not in without for r in rows for c in cols)
        return count / (2 * reach + 1) ** 2

    def all_unknown(self) -> list[Cell]:
        cells = [(r, c) for r in range(self.rows) for c in range(self.cols)]
        return [cell for cell in cells if self.unknown(cell)]


class Paths:
    """Breadth-first search from the robot: lengths L, gains G, and the cell before each."""

    def __init__(self, world: Map, start: Cell):
        world.seen[start] = set()  # nothing more is to be seen from where the robot stands
        self.length, self.gain, self.before = {start: 0}, {start: 0}, {}
        order = [start]
        for here in order:
            for dr, dc in MOVES:
                there = (here[0] + dr, here[1] + dc)
                if not world.is_free(there):
                    continue
                if there not in self.length:
                    self.length[there], self.gain[there] = self.length[here] + 1, -1
                    order.append(there)
                if self.length[there] == self.length[here] + 1:
                    gain = self.gain[here] + len(world.could_see(there) - world.could_see(here))
                    if gain > self.gain[there]:
                        self.gain[there], self.before[there] = gain, here
        self.start = start

    def way(self, goal: Cell) -> list[Cell]:
        """The cells of the way, without the robot's own."""
        cells = []
        while goal != self.start:
            cells.append(goal)
            goal = self.before[goal]
        return cells[::-1]

    def goals(self) -> list[Cell]:
        return [cell for cell in self.length if cell != self.start and self.gain[cell] > 0]


def path_gain_goal(world: Map, paths: Paths, power: float) -> Cell | None:
    """The best goal; ties to the first cell in row-major order."""

    def key(cell):
        gain = paths.gain[cell] + len(world.could_see(cell))
        return -gain / float(paths.length[cell]) ** power, cell

    return min(paths.goals(), key=key, default=None)


def terms(world: Map, paths: Paths, cell: Cell, reach: float, heading, last, ends) -> list[float]:
    """The fourteen terms; ``reach`` is the sensor's range."""
    unit = reach / 5
    near, far = round(3 * unit), round(10 * unit)
    gain, end, length = paths.gain[cell], len(world.could_see(cell)), paths.length[cell]
    known = 1 - len(world.all_unknown()) / (world.rows * world.cols)
    border = min(cell[0], world.rows - 1 - cell[0], cell[1], world.cols - 1 - cell[1])
    away = (cell[0] - paths.start[0], cell[1] - paths.start[1])
    around = world.share_unknown(cell, far)
    stay = 0.0
    if last is not None:
        stay = 1 / (1 + max(abs(cell[0] - last[0]), abs(cell[1] - last[1])) / unit)
    return [
        -math.log(length),
        math.log(gain + ends * end),
        length / 10 / unit,
        end / 20 / unit**2,
        world.share_unknown(cell, near),
        around,
        known * math.log(length),
        known * around,
        border / 10 / unit,
        float(border <= 5 * unit),
        cosine(away, heading),
        stay,
        gain / length / 10 / unit,
        float(abs(away[0]) == abs(away[1])),
    ]


def cosine(a, b) -> float:
    size = math.hypot(*a) * math.hypot(*b)
    return (a[0] * b[0] + a[1] * b[1]) / size if size else 0.0


def linear_score(values: list[float], weights) -> float:
    return values[1] + sum(
        w * x for i, (w, x) in enumerate(zip(weights, values, strict=True)) if i != 1
    )
