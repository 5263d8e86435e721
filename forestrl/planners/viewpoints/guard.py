"""The guard of planners that remember a goal: none of them wavers between goals for ever."""

from __future__ import annotations

from forestrl.kernels.compiling import compiled
from forestrl.planners.viewpoints.paths import Paths
from forestrl.planners.viewpoints.scores import NOWHERE, Memory
from forestrl.planners.viewpoints.views import UNKNOWN, Views


@compiled
def wavers(views: Views, paths: Paths, memory: Memory) -> bool:
    """Tells whether nothing new was seen for longer than the longest path takes.

    Whoever walks to a goal sees something by then. To be asked once a step; it keeps the count.
    """
    unknown = 0
    for cell in views.grid:
        unknown += cell == UNKNOWN
    if unknown == memory.idle[0]:
        memory.idle[1] += 1
    else:
        memory.idle[0], memory.idle[1] = unknown, 0
    return memory.idle[1] > paths.lengths[paths.order[-1]]


@compiled
def nearest_view(views: Views, paths: Paths) -> int:
    """Finds the nearest cell from which something could be seen; ``NOWHERE`` if there is none.

    While the map stays as it is, going there brings it nearer with every step, so it is reached.
    """
    for cell in paths.order[1:]:
        if views.counts[cell] > 0:
            return cell
    return NOWHERE
