"""One state as a picture: the hidden arena, the agent's map, the decision and the legend."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from tensordict import TensorDictBase

from forestrl import functional as F
from forestrl.rendering import panel as P
from forestrl.rendering.panel import Colour, Panel, colours_of
from forestrl.rendering.scene import Cell, Scene

_GAP, _HEAD, _FOOT, _SIDE = 16, 28, 32, 164  # pixels
_ZOOM, _LINE = 48, 20  # pixels: a cell of the decision, a line of the legend
_CAPTION = 400  # pixels, at the most
_TEXT, _SMALL = 15, 12  # size of letters, pixels


def draw_frame(
    td_row: TensorDictBase,
    *,
    scale: int = 7,
    path: Sequence[Cell] = (),
    marks: Sequence[Cell] = (),
    lidar_range: float = 5.0,
) -> Image.Image:
    """Draws one state.

    Left is the hidden arena, in the middle the agent's map with the exploration graph, on the right
    the eight waypoints at large. The frames around both turn purple when the filter steps in.

    Args:
        td_row: a state without batch dimensions, with ``"action"`` and, from a learned policy,
            ``"logits"`` if the policy has seen it.
        scale: side of a cell, pixels.
        path: the cells the agent came through, oldest first.
        marks: the cells where the safety filter stepped in before.
        lidar_range: ``l``, cells.

    Returns:
        an RGB picture.
    """
    scene = Scene(td_row)
    marks = [*marks, scene.agent] if scene.intervened else list(marks)
    panels = {
        "Arena (hidden from the agent)": _arena(scene, scale, path, marks, lidar_range),
        "Agent's map": _map(scene, scale),
        "Decision": _side(scene),
    }
    height = _HEAD + max(panel.height for panel in panels.values()) + _FOOT
    width = _GAP + sum(panel.width + _GAP for panel in panels.values())
    frame = Image.new("RGB", (width, height), P.PAPER)
    pen, font, x = ImageDraw.Draw(frame), ImageFont.load_default(_TEXT), _GAP
    for name, panel in panels.items():
        short = name if pen.textlength(name, font) <= panel.width else name.split(" (")[0]
        pen.text((x, _HEAD / 2), short, P.INK, font, anchor="lm")
        if name != "Decision":
            colour, line = (P.MARK, 3) if scene.intervened else (P.FAINT, 1)
            corner = (x + panel.width + line - 1, _HEAD + panel.height + line - 1)
            pen.rectangle((x - line, _HEAD - line, *corner), fill=colour)
        frame.paste(panel, (x, _HEAD))
        x += panel.width + _GAP
    wide = 2 * (_GAP + panels["Agent's map"].width)
    words = (f"step {scene.step}", f"coverage {scene.coverage:.1%}", f"interventions {len(marks)}")
    caption = "    ".join(words).replace("%", " %")
    fits = wide >= _CAPTION  # else it stands below the legend, not beside it
    more = f"{caption}    stopped: {scene.stopped}"
    if scene.stopped and pen.textlength(more, font) <= (wide if fits else width) - _GAP:
        caption = more
    bottom = _HEAD + panels["Agent's map"].height + _FOOT if fits else height
    pen.text((_GAP, bottom - _FOOT / 2), caption, P.INK, font, anchor="lm")
    return frame


def _arena(
    scene: Scene, scale: int, path: Sequence[Cell], marks: Sequence[Cell], lidar_range: float
) -> Image.Image:
    """Draws the truth: trunks, the way so far, the agent and how far it sees."""
    panel = Panel(colours_of(scene.trees.astype(int), (P.GROUND, P.TRUNK)), scale)
    reach = lidar_range + 0.5
    panel.circle(scene.agent, reach, fill=(*P.AGENT, 34), outline=(*P.AGENT, 150), width=1)
    if path:
        panel.line([*path, scene.agent], P.AGENT, max(1.0, scale / 5))
    for mark in marks:
        panel.diamond(mark, max(0.45, 3 / scale), P.MARK)
    panel.circle(scene.agent, max(0.55, 4 / scale), fill=P.AGENT, outline=P.PAPER)
    return panel.finished()


def _map(scene: Scene, scale: int) -> Image.Image:
    """Draws the belief: what is known, frontiers, graph, waypoints and the agent."""
    panel = Panel(colours_of(scene.cells, (P.UNKNOWN, P.FREE, P.OCCUPIED)), scale)
    for cell in scene.frontier:
        panel.square(cell, P.FRONTIER)
    panel.hairlines(scene.ties, P.EDGE)
    for action in range(1, len(scene.targets)):
        if (tint := _tint(scene, action)) is not None:
            panel.square(scene.targets[action], tint)
        panel.waypoint(scene.targets[action], feasible=scene.feasible[action])
    panel.circle(scene.agent, max(0.45, 3.5 / scale), fill=P.AGENT)
    return panel.finished()


def _side(scene: Scene) -> Image.Image:
    """Draws the decision and, below it, the legend."""
    zoom, entries = _decision(scene), _legend(with_graph=scene.has_graph)
    side = Image.new("RGB", (_SIDE, zoom.height + _LINE // 2 + _LINE * len(entries)), P.PAPER)
    side.paste(zoom, (0, 0))
    pen, font = ImageDraw.Draw(side), ImageFont.load_default(_SMALL)
    for i, (name, ground, paint) in enumerate(entries):
        top = zoom.height + _LINE // 2 + _LINE * i
        swatch = Panel(colours_of(np.zeros((1, 1), int), [ground]), 16)
        paint(swatch)
        pen.rectangle((0, top + 1, 17, top + 18), fill=(200, 200, 200))
        side.paste(swatch.finished(), (1, top + 2))
        pen.text((26, top + _LINE / 2), name, P.INK, font, anchor="lm")
    return side


def _decision(scene: Scene) -> Image.Image:
    """Draws the agent and its waypoints at large, with probabilities and the action taken."""
    rows, cols = scene.cells.shape
    around = np.full((3, 3), int(F.Cell.OCCUPIED))  # as cells outside the arena count
    places = [tuple(cell) for cell in (F.DISPLACEMENTS + 1).tolist()]  # of the actions, Table I
    for place, (row, col) in zip(places, scene.targets, strict=True):
        if 0 <= row < rows and 0 <= col < cols:
            around[place] = scene.cells[row, col]
    panel = Panel(colours_of(around, (P.UNKNOWN, P.PAPER, (150, 150, 150))), _ZOOM)
    lift = 0.0 if scene.probability is None else 0.16  # room for a number below
    for action, (row, col) in enumerate(places):
        if (tint := _tint(scene, action)) is not None:
            panel.square((row, col), tint)
        panel.border((row, col), (*P.FAINT, 120), 1)
        if action == F.NULL_ACTION:
            panel.circle((row - lift, col), 0.24, fill=P.AGENT)
        else:
            panel.waypoint((row - lift, col), feasible=scene.feasible[action], radius=0.22)
    for chosen, colour in ((scene.proposed, P.MARK), (scene.executed, P.AGENT)):
        if chosen is not None:
            panel.border(places[chosen], colour, 3)
    zoom = panel.finished()
    pen, font = ImageDraw.Draw(zoom), ImageFont.load_default(_SMALL)
    for (row, col), share in zip(places, scene.probability or [], strict=False):
        middle = ((col + 0.5) * _ZOOM, (row + 0.78) * _ZOOM)
        pen.text(middle, f"{100 * share:.0f} %", P.INK, font, anchor="mm")
    return zoom


def _tint(scene: Scene, action: int) -> Colour | None:
    """Green, red or, for staying, blue: as strong as the action is likely."""
    if (strength := scene.strength(action)) is None:
        return None
    colour = P.FEASIBLE if scene.feasible[action] else P.INFEASIBLE
    return (*(P.AGENT if action == F.NULL_ACTION else colour), round(170 * strength))


def _legend(*, with_graph: bool) -> list[tuple[str, Colour, Callable[[Panel], None]]]:
    """Lists name, ground and drawing of every sign; (0, 0) is the middle of its one cell."""

    def nothing(_: Panel) -> None:
        pass

    def way(panel: Panel) -> None:
        panel.line([(0.3, -0.5), (0, -0.1), (-0.2, 0.5)], P.AGENT, 2)

    def reach(panel: Panel) -> None:
        panel.circle((0.5, -0.5), 0.8, fill=(*P.AGENT, 34), outline=(*P.AGENT, 150))

    def edge(panel: Panel) -> None:
        panel.line([(0.5, -0.5), (-0.5, 0.5)], P.EDGE, 1)

    entries = [
        ("agent", P.PAPER, lambda panel: panel.circle((0, 0), 0.3, fill=P.AGENT)),
        ("way so far", P.GROUND, way),
        ("filter stepped in", P.GROUND, lambda panel: panel.diamond((0, 0), 0.34, P.MARK)),
        ("sensor range", P.GROUND, reach),
        ("trunk", P.TRUNK, nothing),
        ("unknown", P.UNKNOWN, nothing),
        ("known to be free", P.FREE, nothing),
        ("known to be occupied", P.OCCUPIED, nothing),
        ("frontier", P.FRONTIER, nothing),
        ("graph edge", P.PAPER, edge),
        ("feasible waypoint", P.PAPER, lambda panel: panel.waypoint((0, 0), feasible=True)),
        ("infeasible waypoint", P.PAPER, lambda panel: panel.waypoint((0, 0), feasible=False)),
        ("executed action", P.PAPER, lambda panel: panel.border((0, 0), P.AGENT, 3)),
        ("replaced action", P.PAPER, lambda panel: panel.border((0, 0), P.MARK, 3)),
    ]
    return [entry for entry in entries if with_graph or entry[0] != "graph edge"]
