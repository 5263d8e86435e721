"""Evaluation on fixed test arenas: drawing them, running policies on them, reporting."""

from forestrl.evaluation.arenas import arena_generator, draw_arenas, uniforms
from forestrl.evaluation.episodes import Curve, Episodes, evaluate

__all__ = ["Curve", "Episodes", "arena_generator", "draw_arenas", "evaluate", "uniforms"]
