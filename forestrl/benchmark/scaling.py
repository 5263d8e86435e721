"""Cost against work: how the time of a frame grows with the arena and the number of arenas."""

from __future__ import annotations

import gc
import io
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from forestrl import functional as F
from forestrl.benchmark import stages
from forestrl.benchmark.cell import measure_steps
from forestrl.benchmark.report import to_csv
from forestrl.benchmark.run import Forests, Makers, by_work, explore_all
from forestrl.benchmark.states import arrange
from forestrl.storage import atomic_write

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "black")


@dataclass(frozen=True)
class Cost:
    """The cost of one stage at one arena side and number of arenas.

    Attributes:
        stage: name of the stage; an env stage includes those before it.
        size: arena side, cells.
        num_envs: arenas stepped at once.
        work: what one frame has to look at. For an env step that is the cells of the arena; for
            the graph the arena once more and the window around each node; for the reward the arena
            once more and the window around each frontier cell; for the policy the nodes.
        seconds: time of one frame.
        frames_per_second: its inverse.
        growth: how much longer than in the smallest arena a frame takes, divided by how much more
            work it is, at the same number of arenas; up to 1 if the cost grows no faster than the
            work.
    """

    stage: str
    size: int
    num_envs: int
    work: float
    seconds: float
    frames_per_second: float
    growth: float


def measure_scaling(
    makers: Makers,
    sizes: Sequence[int],
    num_envs: Sequence[int],
    seconds: float,
    progress: Callable[[str], object],
) -> list[Cost]:
    """Times the env with each transform, the policy and evaluation at all sizes and arenas.

    Args:
        makers: builds what is measured.
        sizes: arena sides, cells.
        num_envs: numbers of arenas stepped at once.
        seconds: budget for each stage of each cell.
        progress: told what was measured.
    """
    explored, frame = explore_all(makers, sizes), {}
    for size, arenas in by_work(sizes, num_envs):
        parts = makers.parts(size, arenas, explored[size].max_frontiers)
        timings = measure_steps(parts, arrange(explored[size].worlds, arenas), seconds)
        for stage, timing in timings.items():
            frame[stage, size, arenas] = timing.median / arenas
        del parts
        gc.collect()
        progress(f"{arenas} of {size} x {size}")
    return [
        _cost(stage, explored[size], explored[min(sizes)], arenas, makers.window, frame)
        for stage, size, arenas in frame
    ]


def _cost(
    stage: str,
    forests: Forests,
    smallest: Forests,
    arenas: int,
    window: int,
    frame: dict[tuple[str, int, int], float],
) -> Cost:
    size, least = forests.blank.size, smallest.blank.size
    seconds, fewest = frame[stage, size, arenas], frame[stage, least, arenas]
    work = _work(stage, forests, window)
    growth = seconds / fewest / (work / _work(stage, smallest, window))
    return Cost(stage, size, arenas, work, seconds, 1 / seconds, growth)


def _work(stage: str, forests: Forests, window: int) -> float:
    """Counts what one frame of a stage has to look at, see :class:`Cost`."""
    area, frontiers = forests.blank.size**2, forests.blank.frontiers or 0.0
    nodes = F.WAYPOINTS + frontiers
    if stage == stages.POLICY:
        return nodes
    graph = area + nodes * window**2
    reward = area + frontiers * window**2
    return area + {"+ graph": graph, "+ reward": graph + reward, stages.EVALUATION: graph}.get(
        stage, 0.0
    )


def write_scaling(costs: Sequence[Cost], folder: Path) -> str:
    """Writes ``scaling.csv``, ``scaling.txt`` and ``scaling.png``; returns the table."""
    text = _table(costs)
    names = [field.name for field in fields(Cost)]
    atomic_write(folder / "scaling.csv", to_csv(names, map(asdict, costs)))
    atomic_write(folder / "scaling.txt", text + "\n")
    atomic_write(folder / "scaling.png", _picture(costs))
    return text


def _table(costs: Sequence[Cost]) -> str:
    arenas = sorted({cost.num_envs for cost in costs})
    head = f"{'cost against work':<18}{'side':>6}{'work':>9}"
    head += "".join(f"{n:>10}" for n in arenas) + f"{'growth':>9}"
    lines = ["frames/s by arenas at once", head]
    for stage in dict.fromkeys(cost.stage for cost in costs):
        for size in sorted({cost.size for cost in costs}):
            chosen = {c.num_envs: c for c in costs if (c.stage, c.size) == (stage, size)}
            speeds = "".join(f"{chosen[n].frames_per_second:>10,.0f}" for n in arenas)
            worst = max(cost.growth for cost in chosen.values())
            lines.append(
                f"{stage:<18}{size:>6}{chosen[arenas[0]].work:>9,.0f}{speeds}{worst:>9.2f}"
            )
    note = "growth: of the time of a frame over that of its work, the largest; up to 1: no faster."
    return "\n".join([*lines, note])


def _picture(costs: Sequence[Cost]) -> bytes:
    """Draws speed against the number of arenas, and the time of a frame against the arena."""
    figure = Figure(figsize=(10, 4.2), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    _draw_arenas(left, costs)
    _draw_sizes(right, costs)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _draw_arenas(axes: Axes, costs: Sequence[Cost]) -> None:
    for size, colour in zip(sorted({cost.size for cost in costs}), _COLOURS * 9, strict=False):
        line = [c for c in costs if c.size == size and c.stage == stages.EVALUATION]
        line.sort(key=lambda cost: cost.num_envs)
        speeds = [cost.frames_per_second for cost in line]
        axes.loglog([c.num_envs for c in line], speeds, "o-", color=colour, label=f"side {size}")
    arenas = sorted({cost.num_envs for cost in costs})
    axes.set_xticks(arenas, [str(n) for n in arenas])
    _finish(axes, "one evaluation step", "arenas stepped at once", "frames/s")


def _draw_sizes(axes: Axes, costs: Sequence[Cost]) -> None:
    arenas = max(cost.num_envs for cost in costs)
    names = dict.fromkeys(cost.stage for cost in costs)
    for stage, colour in zip(names, _COLOURS * 9, strict=False):
        line = [c for c in costs if c.num_envs == arenas and c.stage == stage]
        line.sort(key=lambda cost: cost.size)
        area, time = [c.size**2 for c in line], [1e6 * c.seconds for c in line]
        axes.loglog(area, time, "o-", color=colour, label=stage)
        axes.loglog(area, [time[0] * a / area[0] for a in area], ":", color=colour, lw=0.8)
    sides = sorted({cost.size for cost in costs})
    axes.set_xticks([side**2 for side in sides], [f"{side} x {side}" for side in sides])
    _finish(axes, f"{arenas} arenas at once; dotted: as the area", "cells", "microseconds a frame")


def _finish(axes: Axes, title: str, xlabel: str, ylabel: str) -> None:
    axes.set_title(title, fontsize=11)
    axes.set(xlabel=xlabel, ylabel=ylabel)
    axes.xaxis.minorticks_off()
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="0.9", lw=0.8)
    axes.legend(frameon=False, fontsize=8)
