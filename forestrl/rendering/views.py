"""Views of one scene: the hidden arena, the agent's map, and the decision at large."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from forestrl import functional as F
from forestrl.rendering import panel as P
from forestrl.rendering.panel import Colour, Panel, colours_of
from forestrl.rendering.scene import Scene

_ZOOM, _LETTERS = 48, 12  # pixels: a cell of the decision, size of letters


def draw_arena(
    scene: Scene, scale: int, *, veiled: bool = False, agent: Colour = P.AGENT
) -> Image.Image:
    """Draws the truth: trunks, the way so far, the agent and how far it sees.

    Args:
        scene: what is drawn.
        scale: side of a cell, pixels.
        veiled: darken what the agent does not know, and mark the frontier.
        agent: the agent's colour.
    """
    ground = scene.trees.astype(int)
    if veiled:
        ground += 2 * (scene.cells == F.Cell.UNKNOWN)
    panel = Panel(colours_of(ground, (P.GROUND, P.TRUNK, P.UNKNOWN, P.VEILED)), scale)
    for cell in scene.frontier if veiled else ():
        panel.square(cell, P.FRONTIER)
    reach = scene.lidar_range + 0.5
    panel.circle(scene.agent, reach, fill=(*agent, 34), outline=(*agent, 150))
    if len(scene.way) > 1:
        panel.line(scene.way, agent, min(max(1.0, scale / 5), 3.0))
    for cell in scene.interventions:
        panel.diamond(cell, max(0.45, 3 / scale), P.INTERVENTION)
    for cell in scene.collisions:
        panel.star(cell, max(0.6, 4 / scale), P.COLLISION)
    panel.circle(scene.agent, max(0.4, 4 / scale), fill=agent, outline=P.PAPER)
    return panel.finished()


def draw_map(scene: Scene, scale: int) -> Image.Image:
    """Draws the belief: what is known, frontiers, graph, waypoints and the agent."""
    panel = Panel(colours_of(scene.cells, (P.UNKNOWN, P.FREE, P.OCCUPIED)), scale)
    for cell in scene.frontier:
        panel.square(cell, P.FRONTIER)
    panel.hairlines(scene.ties, P.EDGE)
    for action in range(1, len(scene.targets)):
        if (tint := _tint(scene, action)) is not None:
            panel.square(scene.targets[action], tint)
        panel.waypoint(scene.targets[action], feasible=scene.feasible[action])
    panel.circle(scene.agent, max(0.36, 3.5 / scale), fill=P.AGENT)
    return panel.finished()


def draw_decision(scene: Scene) -> Image.Image:
    """Draws the agent and its waypoints at large, with probabilities and the action taken."""
    rows, cols = scene.cells.shape
    around = np.full((3, 3), int(F.Cell.OCCUPIED))  # as cells outside the arena count
    places = [tuple(cell) for cell in (F.DISPLACEMENTS + 1).tolist()]  # of the actions, Table I
    for place, (row, col) in zip(places, scene.targets, strict=True):
        if 0 <= row < rows and 0 <= col < cols:
            around[place] = scene.cells[row, col]
    panel = Panel(colours_of(around, (P.UNKNOWN, P.PAPER, P.SOLID)), _ZOOM)
    lift = 0.0 if scene.probability is None else 0.16  # room for a number below
    for action, (row, col) in enumerate(places):
        if (tint := _tint(scene, action)) is not None:
            panel.square((row, col), tint)
        panel.border((row, col), (*P.FAINT, 120), 1)
        if action == F.NULL_ACTION:
            panel.circle((row - lift, col), 0.24, fill=P.AGENT)
        else:
            panel.waypoint((row - lift, col), feasible=scene.feasible[action], radius=0.22)
    for chosen, colour in ((scene.proposed, P.INTERVENTION), (scene.executed, P.AGENT)):
        if chosen is not None:
            panel.border(places[chosen], colour, 3)
    if scene.collided and scene.executed is not None:
        row, col = places[scene.executed]
        panel.star((row - lift, col), 0.4, P.COLLISION)
    zoom = panel.finished()
    pen, font = ImageDraw.Draw(zoom), ImageFont.load_default(_LETTERS)
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
