"""How an episode stands, in words."""

from __future__ import annotations

from forestrl.rendering.layout import Entry
from forestrl.rendering.scene import Scene
from forestrl.status import Status


def step(scene: Scene) -> Entry:
    """Says how many steps were made."""
    return Entry(f"step {scene.step}", "step 99999")


def coverage(scene: Scene) -> Entry:
    """Says how much is known."""
    return Entry(f"coverage {100 * scene.coverage:.1f} %", "coverage 100.0 %")


def safety(scene: Scene) -> Entry:
    """Counts interventions; collisions where there is no filter, or one that lets them happen."""
    collisions = f"collisions {len(scene.collisions)}"
    if not scene.has_filter:
        return Entry(f"no filter, {collisions}", "no filter, collisions 9999")
    interventions = f"interventions {len(scene.interventions)}"
    return Entry(collisions if scene.collisions else interventions, "interventions 9999")


def outcome(scene: Scene) -> Entry:
    """Says how the episode ended, or why a planner stays where it is; nothing before."""
    text = ""
    if scene.coverage >= scene.coverage_goal:
        text = f"{100 * scene.coverage_goal:g} % at step {scene.step}"
    elif scene.status != Status.EXPLORING:
        text = f"stopped: {scene.status.name.lower().replace('_', ' ')}"
    return Entry(text, "stopped: no reachable frontier")
