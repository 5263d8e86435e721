"""The planners as slow loops over plain Python lists, written from their description."""

from __future__ import annotations

import heapq
import math
from collections import deque
from fractions import Fraction

from tests.oracles import (
    FREE,
    OCCUPIED,
    TABLE_1,
    UNKNOWN,
    Cell,
    Grid,
    add,
    all_cells,
    frontier,
    inside,
    path_lengths,
    window_count,
)

UP, LEFT, DOWN, RIGHT = (-1, 0), (0, -1), (1, 0), (0, 1)


def at(cells: Grid, cell: Cell) -> int:
    """A cell of the walled arena."""
    return cells[cell[0]][cell[1]] if inside(cells, cell) else OCCUPIED


def around(cell: Cell) -> list[Cell]:
    """The 3 x 3 around a cell in row-major order."""
    return [add(cell, (row, col)) for row in (-1, 0, 1) for col in (-1, 0, 1)]


def gain_goal(cells: Grid, position: Cell, *, window: int, power: float) -> Cell | None:
    """The frontier cell with the most unknown cells around per path length to some power."""
    free = [[code == FREE for code in row] for row in cells]
    unknown = [[code == UNKNOWN for code in row] for row in cells]
    lengths = path_lengths(free, position)
    scores = {
        cell: window_count(unknown, cell, window) / float(lengths[cell]) ** power
        for cell in sorted(frontier(cells))
        if lengths.get(cell, 0) > 0
    }
    return max(scores, key=scores.__getitem__) if scores else None


def towards(cells: Grid, position: Cell, goal: Cell | None) -> int:
    """The first action of a shortest path over known free cells, the lowest index of them."""
    if goal is None:
        return 0
    free = [[code == FREE for code in row] for row in cells]
    lengths = path_lengths(free, goal)
    return min(range(1, 9), key=lambda a: (lengths.get(add(position, TABLE_1[a]), 10**6), a))


def strict_frontier(cells: Grid) -> list[Cell]:
    """1.3: unknown cells beside a free cell that has a free cell ahead or at its sides."""
    found = []
    for cell in all_cells(cells):
        for d in (DOWN, RIGHT, UP, LEFT):
            n, across = add(cell, d), (d[1], d[0])
            sides = [add(n, d), add(n, across), add(n, (-across[0], -across[1]))]
            if (
                at(cells, cell) == UNKNOWN
                and at(cells, n) == FREE
                and any(at(cells, side) == FREE for side in sides)
            ):
                found.append(cell)
                break
    return found


def clusters(frontiers: list[Cell]) -> list[list[Cell]]:
    """1.4: popped from the end of the list, grown backwards over what remains."""
    rest, found = list(frontiers), []
    while rest:
        cluster, grew = [rest.pop()], True
        while grew:
            grew = False
            for cell in reversed(list(rest)):
                if any(abs(cell[0] - r) + abs(cell[1] - c) < 3 for r, c in cluster):
                    cluster.append(cell)
                    rest.remove(cell)
                    grew = True
        found.append(cluster)
    return found


def centre(cluster: list[Cell]) -> Cell:
    """1.4: the member nearest to the mean by Manhattan distance, the first grown on ties."""
    row = Fraction(sum(cell[0] for cell in cluster), len(cluster))
    col = Fraction(sum(cell[1] for cell in cluster), len(cluster))
    return min(cluster, key=lambda cell: abs(cell[0] - row) + abs(cell[1] - col))


def distance_map(cells: Grid, source: Cell) -> dict[Cell, int]:
    """1.5: -2 on obstacles, -1 on unknown, 0 on unreached free cells and on the source."""
    code = {OCCUPIED: -2, UNKNOWN: -1, FREE: 0}
    distance = {cell: code[at(cells, cell)] for cell in all_cells(cells)}
    steps, queue = {source: 0}, deque([source])
    while queue:
        cell = queue.popleft()
        for d in (UP, LEFT, DOWN, RIGHT):
            near = add(cell, d)
            if at(cells, near) == FREE and near not in steps:
                steps[near] = steps[cell] + 1
                queue.append(near)
    return distance | steps


def cost_goal(cells: Grid, position: Cell) -> Cell | None:
    """1.6: the first free cell around the centre at the smallest distance."""
    distance = distance_map(cells, position)
    goals = []
    for cluster in clusters(strict_frontier(cells)):
        free = [cell for cell in around(centre(cluster)) if at(cells, cell) == FREE]
        goals += free[:1]
    return min(goals, key=distance.__getitem__) if goals else None


def mmpf_goal(cells: Grid, position: Cell) -> Cell:
    """1.8, points 1 to 4, with the iterations that it wastes."""
    groups = clusters(strict_frontier(cells))
    centres = [centre(group) for group in groups]
    distances = [distance_map(cells, c) for c in centres]
    path, level, least, gain, iterations = [position], 10000.0, 10000, 1, 0

    def potential(cell: Cell) -> float:
        value = 0.0
        for group, distance in zip(groups, distances, strict=True):
            if distance.get(cell, -2) >= 1:
                value -= len(group) / distance[cell]
        return value + 5 * gain * path.count(cell)

    while iterations < 60 and least > 1:  # 3000 in the original; the first failure is final
        iterations += 1
        around_here = [add(path[-1], d) for d in (UP, LEFT, DOWN, RIGHT)]
        best = min(around_here, key=potential)
        if potential(best) < level:
            level = potential(best)
            path.append(best)
        else:
            gain += 1
        here, least = path[-1], 10000
        for c, distance in zip(centres, distances, strict=True):
            d = distance.get(here, -2)
            if d != 0 or c == here:
                least = min(least, d)
    return path[-1]


def a_star(trees: Grid, source: Cell, goal: Cell) -> Cell | None:
    """1.7: the second cell of the path, None if there is no path."""
    spent, parent, heap = {source: 0.0}, {}, [(0.0, source)]
    while heap:
        _, cell = heapq.heappop(heap)
        if cell == goal:
            break
        for offset in TABLE_1[1:]:
            near = add(cell, offset)
            if not inside(trees, near) or trees[near[0]][near[1]]:
                continue
            new = spent[cell] + math.sqrt(offset[0] ** 2 + offset[1] ** 2)
            if new < spent.get(near, math.inf):
                spent[near], parent[near] = new, cell
                left = math.sqrt((near[0] - goal[0]) ** 2 + (near[1] - goal[1]) ** 2)
                heapq.heappush(heap, (new + left, near))
    if goal not in parent:
        return None
    while parent[goal] != source:
        goal = parent[goal]
    return goal


def published(cells: Grid, position: Cell, trees: Grid, goal: Cell | None) -> tuple[int, str]:
    """1.6, steps 1 and 5: action and status."""
    if goal is None:
        return 0, "NO_REACHABLE_FRONTIER" if frontier(cells) else "COVERED"
    if goal == position:
        return 0, "AT_GOAL"
    if not inside(trees, goal) or trees[goal[0]][goal[1]]:
        return 0, "GOAL_NOT_FREE"
    step = a_star(trees, position, goal)
    if step is None:
        return 0, "NO_REACHABLE_FRONTIER"
    return TABLE_1.index((step[0] - position[0], step[1] - position[1])), "EXPLORING"


# Corrected.


def reachable_frontier(cells: Grid, lengths: dict[Cell, int]) -> list[Cell]:
    """The published frontier in reach, or else every unknown cell with a neighbour in reach."""
    for found in (strict_frontier(cells), [c for c in all_cells(cells) if at(cells, c) == UNKNOWN]):
        reached = [cell for cell in found if any(near in lengths for near in around(cell))]
        if reached:
            return reached
    return []


def corrected_goal(cells: Grid, position: Cell, *, downhill: bool) -> Cell | None:
    """The goal of the two corrected planners."""
    free = [[code == FREE for code in row] for row in cells]
    lengths = path_lengths(free, position)
    groups = clusters(reachable_frontier(cells, lengths))
    if not groups:
        return None
    centres = [centre(group) for group in groups]
    if not downhill:
        goals = [next(cell for cell in around(c) if cell in lengths) for c in centres]
        return min(goals, key=lengths.__getitem__)
    distances = [path_lengths(free, c) for c in centres]
    visits = dict.fromkeys(lengths, 0)

    def level(cell: Cell) -> float:
        value = 0.0
        for group, distance in zip(groups, distances, strict=True):
            value -= len(group) / distance[cell]
        for _ in range(visits[cell]):
            value += 5.0
        return value

    here = position
    while min(distance[here] for distance in distances) > 1:
        visits[here] += 1
        here = min((c for a in TABLE_1[1:] if (c := add(here, a)) in visits), key=level)
    return here


def corrected(cells: Grid, position: Cell, *, downhill: bool) -> tuple[int, str]:
    """The first step towards a new goal: A* over all that is not known to be a tree."""
    goal = corrected_goal(cells, position, downhill=downhill)
    trees = [[code == OCCUPIED for code in row] for row in cells]
    return published(cells, position, trees, goal)
