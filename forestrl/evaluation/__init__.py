"""Evaluation on fixed test arenas: drawing them, running policies on them, reporting."""

from forestrl.evaluation.arenas import test_arenas, test_generator, uniforms
from forestrl.evaluation.episodes import Curve, Episodes, evaluate

__all__ = ["Curve", "Episodes", "evaluate", "test_arenas", "test_generator", "uniforms"]
