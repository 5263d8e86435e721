"""Candidates and what is known of them as slow loops over plain Python."""

from __future__ import annotations

import math

from tests.oracles import FREE, OCCUPIED, inside
from tests.planners.viewpoints import MOVES, Map, Paths, cosine, linear_score, terms


def apart(a, b) -> int:
    return max(abs(a[0] - b[0]), abs(a[1] - b[1]))


def candidates(scores, least, most):
    """The best cells, none closer than ``least`` to a better one; ties to the first cell."""
    picked = []
    for cell in sorted(scores, key=lambda cell: (-scores[cell], cell)):
        if len(picked) < most and all(apart(cell, other) >= least for other in picked):
            picked.append(cell)
    return picked


def pocket(world: Map, start) -> set:
    """The 8-connected unknown cells around one of them."""
    found, left = {start}, [start]
    while left:
        row, col = left.pop()
        near = {(row + dr, col + dc) for dr, dc in MOVES} - found
        left += (new := [cell for cell in near if world.unknown(cell)])
        found |= set(new)
    return found


def mean_distance(world: Map, cell) -> float:
    """From the unknown cells, each counted in the middle of its block of 5 x 5."""
    middles = [(r // 5 * 5 + 2, c // 5 * 5 + 2) for r, c in world.all_unknown()]
    return sum(apart(cell, middle) for middle in middles) / max(len(middles), 1)


def straight_on(world: Map, cell, moves):
    rates = []
    for dr, dc in MOVES:
        here, seen = cell, 0
        for _ in range(moves):
            there = (here[0] + dr, here[1] + dc)
            if not inside(world.cells, there) or world.cells[there[0]][there[1]] == OCCUPIED:
                break
            seen += len(world.could_see(there) - world.could_see(here))
            here = there
        rates.append(seen / moves)
    second, best = sorted(rates)[-2:]
    return best, sum(rates) / 8, second


def features(world: Map, paths: Paths, cells, weights, reach, heading, last, share):
    """What is known of each of the cells."""
    unit, start = reach / 5, paths.start
    near, far = round(3 * unit), round(10 * unit)
    revealed = {
        cell: set().union(*(world.could_see(each) for each in paths.way(cell))) for cell in cells
    }
    free = sum(row.count(FREE) for row in world.cells)
    unknown = len(world.all_unknown())
    density = free / max(world.rows * world.cols - unknown, 1)
    need = max(1.0, share * (free + density * unknown) - free)
    rows = []
    for cell in cells:
        values = terms(world, paths, cell, reach, heading, last, math.exp(weights[1]))
        shown, length, way = revealed[cell], paths.length[cell], paths.way(cell)
        best, mean, second = straight_on(world, cell, max(2, round(5 * unit)))
        first = (way[0][0] - start[0], way[0][1] - start[1])
        before = paths.before[cell]
        rows.append(
            [
                *values,
                linear_score(values, weights),
                len(shown) / 50 / unit**2,
                len(shown) / length / 10 / unit,
                math.log(max(len(shown), 1)),
                len(shown) / (paths.gain[cell] + len(world.could_see(cell))),
                world.share_unknown(cell, near, shown),
                world.share_unknown(cell, far, shown),
                best / 15 / unit,
                mean / 15 / unit,
                second / 15 / unit,
                (mean_distance(world, cell) - mean_distance(world, start)) / 10 / unit,
                math.log(1 + max((len(pocket(world, each)) for each in shown), default=0)) / 8,
                min(1.0, len(shown) * density / need),
                float(len(shown) * density >= need),
                max(min(r, n - 1 - r) for r, n in zip(cell, (world.rows, world.cols), strict=True))
                / 10
                / unit,
                cosine(first, heading),
                float(abs(cell[0] - before[0]) == abs(cell[1] - before[1])),
                world.share_unknown(start, far, shown),
                sum(
                    len(world.could_see(other)) * math.exp(-apart(other, cell) / 10 / unit)
                    for other in cells
                    if other != cell and other not in shown
                )
                / 100
                / unit**2,
                1 - unknown / (world.rows * world.cols),
            ]
        )
    return rows
