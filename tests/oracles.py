"""The specification as slow double loops over plain Python lists, to compare the library with.

A grid is a list of rows, a cell is a tuple ``(row, col)``, a set of cells is a set.
"""

from __future__ import annotations

import math
from collections import deque

Cell = tuple[int, int]
Grid = list[list[int]]

UNKNOWN, FREE, OCCUPIED = 0, 1, 2
TABLE_1 = [(0, 0), (-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]


def all_cells(grid: Grid) -> list[Cell]:
    """Every cell in row-major order."""
    return [(row, col) for row in range(len(grid)) for col in range(len(grid[0]))]


def inside(grid: Grid, cell: Cell) -> bool:
    return 0 <= cell[0] < len(grid) and 0 <= cell[1] < len(grid[0])


def add(cell: Cell, offset: Cell) -> Cell:
    return cell[0] + offset[0], cell[1] + offset[1]


def neighbours(grid: Grid, cell: Cell) -> list[Cell]:
    """The up to eight cells around ``cell`` that lie inside the arena."""
    around = [add(cell, offset) for offset in TABLE_1[1:]]
    return [other for other in around if inside(grid, other)]


# Sec. II-A: the LiDAR.


def sight_line(offset: Cell) -> list[Cell]:
    """The offsets strictly between (0, 0) and ``offset`` on the discrete line."""
    n = max(abs(offset[0]), abs(offset[1]))

    def rounded(numerator: int) -> int:
        """``numerator / n`` to the nearest integer, halves away from zero, without floats."""
        magnitude = (2 * abs(numerator) + n) // (2 * n)
        return magnitude if numerator >= 0 else -magnitude

    return [(rounded(i * offset[0]), rounded(i * offset[1])) for i in range(1, n)]


def scan(trees: Grid, position: Cell, lidar_range: float) -> set[Cell]:
    """The cells seen from ``position``."""
    seen = set()
    for cell in all_cells(trees):
        offset = (cell[0] - position[0], cell[1] - position[1])
        if offset[0] ** 2 + offset[1] ** 2 <= lidar_range**2:
            between = [add(position, step) for step in sight_line(offset)]
            if not any(trees[row][col] for row, col in between):
                seen.add(cell)
    return seen


# Sec. II-A: actions and the safety filter.


def feasible(cells: Grid, position: Cell) -> list[bool]:
    """Which of the nine actions are feasible on the agent's map; the null action always is."""
    targets = [add(position, offset) for offset in TABLE_1[1:]]
    return [True] + [inside(cells, (r, c)) and cells[r][c] == FREE for r, c in targets]


def safe_action(action: int, feasible_actions: list[bool]) -> int:
    """Algorithm 1."""
    if feasible_actions[action]:
        return action
    candidates = [i for i in range(1, 9) if feasible_actions[i]]
    return min(candidates, key=lambda i: (abs(i - action), i)) if candidates else 0


# Sec. II-A: components, and the paths through them.


def path_lengths(free: Grid, source: Cell) -> dict[Cell, int]:
    """Moves from ``source`` to every cell that can be reached over 8-connected free cells."""
    lengths, queue = {source: 0}, deque([source])
    while queue:
        cell = queue.popleft()
        for row, col in neighbours(free, cell):
            if free[row][col] and (row, col) not in lengths:
                lengths[row, col] = lengths[cell] + 1
                queue.append((row, col))
    return lengths


def component(free: Grid, position: Cell) -> set[Cell]:
    """The 8-connected component of free cells that ``position`` lies in."""
    return set(path_lengths(free, position))


def components(free: Grid) -> list[set[Cell]]:
    """All 8-connected components of free cells."""
    found: list[set[Cell]] = []
    for row, col in all_cells(free):
        if free[row][col] and not any((row, col) in known for known in found):
            found.append(component(free, (row, col)))
    return found


def coverage(cells: Grid, traversable: set[Cell]) -> float:
    """Known free cells over traversable cells, both within the start's component."""
    return sum(cells[row][col] == FREE for row, col in traversable) / len(traversable)


# Sec. II-B: the exploration graph.


def frontier(cells: Grid) -> set[Cell]:
    """Known free cells with an unknown 8-neighbour inside the arena."""
    return {
        (row, col)
        for row, col in all_cells(cells)
        if cells[row][col] == FREE
        and any(cells[r][c] == UNKNOWN for r, c in neighbours(cells, (row, col)))
    }


def nearest_first(cells: set[Cell], position: Cell) -> list[Cell]:
    """Cells by Euclidean distance to ``position``, ties in row-major order."""
    row, col = position
    return sorted(cells, key=lambda cell: ((cell[0] - row) ** 2 + (cell[1] - col) ** 2, cell))


def window(centre: Cell, side: int) -> list[Cell]:
    """The ``side`` x ``side`` cells around ``centre``, in the arena or not."""
    reach = range(-(side // 2), side // 2 + 1)
    return [add(centre, (row, col)) for row in reach for col in reach]


def window_count(mask: Grid, centre: Cell, side: int) -> int:
    """How many cells of the mask lie in the window; outside the arena there are none."""
    return sum(inside(mask, (r, c)) and bool(mask[r][c]) for r, c in window(centre, side))


def features(cells: Grid, node: Cell, kind: int, side: int) -> list[float]:
    """The eight features of a node; ``kind`` is the position of the one in the one-hot."""
    frontiers = frontier(cells)
    counts = [0, 0, 0, 0]  # free, unknown, occupied, frontier
    for row, col in window(node, side):
        code = cells[row][col] if inside(cells, (row, col)) else OCCUPIED
        counts[{FREE: 0, UNKNOWN: 1, OCCUPIED: 2}[code]] += 1
        counts[3] += (row, col) in frontiers
    return [float(i == kind) for i in range(4)] + [count / side**2 for count in counts]


Node = tuple[int, int, int]  # its index among the first nine, or 9 for a frontier; row; col
Edges = dict[tuple[Node, Node], float]  # (source, target): length in units of the LiDAR range


def graph(
    cells: Grid, position: Cell, *, side: int, lidar_range: float
) -> tuple[dict[Node, list[float]], Edges]:
    """Features by node, and the length of every directed edge."""
    actions = feasible(cells, position)
    waypoints = [(i, *add(position, TABLE_1[i])) for i in range(1, 9)]
    agent, leaves = (0, *position), [(9, *cell) for cell in frontier(cells)]
    kinds = (
        {agent: 0} | {w: 1 if actions[w[0]] else 2 for w in waypoints} | dict.fromkeys(leaves, 3)
    )
    x = {node: features(cells, node[1:], kind, side) for node, kind in kinds.items()}

    pairs = [(node, node) for node in kinds]  # self-loops
    for w in waypoints:
        pairs += [(agent, w), (w, agent)]
        pairs += [(w, v) for v in waypoints if v != w and math.dist(w[1:], v[1:]) < 1.5]  # Eq. 1
    for f in leaves:
        nearest = min(waypoints, key=lambda w: (math.dist(w[1:], f[1:]), w))  # Eq. 2
        pairs += [(f, nearest), (nearest, f)]
    return x, {(u, v): math.dist(u[1:], v[1:]) / lidar_range for u, v in pairs}


# Sec. II-D: the reward.


def potential(cells: Grid, position: Cell, *, side: int, beta: float) -> float:
    """Equations 7 to 9: the best of all frontiers, 0 if there is none."""
    values = [0.0]
    unknown = [[code == UNKNOWN for code in row] for row in cells]
    for cell in frontier(cells):
        distance = math.dist(cell, position) / (math.sqrt(2) * (len(cells) - 1))
        gain = window_count(unknown, cell, side) / side**2
        values.append((-distance + beta * gain + 1) / (1 + beta))
    return max(values)


def reward(new_cells: float, before: float, after: float, *, explored: bool, unsafe: bool) -> float:
    """Equation 6 with r_exp = 100 and r_sigma = -5."""
    if unsafe:
        return -5.0
    return 100.0 if explored else new_cells + after - before
