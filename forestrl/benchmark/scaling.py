"""Cost against work: how the time of a frame grows with the arena."""

from __future__ import annotations

from collections.abc import Sequence

from torch.utils.benchmark import Measurement

from forestrl import functional as F
from forestrl.benchmark.measuring import About, known
from forestrl.envs.graph import WINDOW


def work(stage: str, about: About) -> float:
    """Counts what one frame of a stage has to look at.

    For an env step that is the cells of the arena; for the graph the arena once more and the window
    around each node; for the reward the arena once more and the window around each frontier cell;
    for the policy the nodes.
    """
    area, frontiers = about["rows"] * about["columns"], about["frontiers"]
    nodes = F.WAYPOINTS + frontiers
    if stage == "policy forward":
        return nodes
    graph, reward = area + nodes * WINDOW**2, area + frontiers * WINDOW**2
    more = {"+ graph": graph, "+ reward": graph + reward, "evaluation step": graph}
    return area + more.get(stage, 0.0)


def growth(measured: Sequence[Measurement]) -> dict[str, float]:
    """Compares the time of a frame with that in the smallest arena, and its work likewise.

    Returns:
        how many times as fast as its work the time of each stage grows, the largest over arenas and
        their number; up to 1 if it grows no faster. Nothing if there is but one arena.
    """
    first: dict[tuple[str, int], Measurement] = {}
    largest: dict[str, float] = {}
    steps = [each for each in measured if "work" in known(each)]
    for each in sorted(steps, key=lambda each: known(each)["work"]):
        smallest = first.setdefault((each.sub_label, known(each)["num_envs"]), each)
        if each is not smallest:
            grown = each.median / smallest.median * known(smallest)["work"] / known(each)["work"]
            largest[each.sub_label] = max(grown, largest.get(each.sub_label, 0))
    return largest
