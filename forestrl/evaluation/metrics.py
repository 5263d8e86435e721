"""An evaluation in a few scalars, under the names that dashboards know."""

from __future__ import annotations

import numpy as np

from forestrl.evaluation.episodes import Episodes

_LEVELS = (80, 95, 98)


def eval_metrics(episodes: Episodes) -> dict[str, float]:
    """Sums an evaluation up.

    Returns:
        ``eval/coverage`` at the end, ``eval/auc`` over the whole budget, ``eval/steps_to_*`` over
        the arenas that got there (nan if none did), ``eval/intervention_rate`` and
        ``eval/collisions``.
    """
    metrics = {
        "eval/coverage": float(episodes.coverage[:, -1].mean()),
        "eval/auc": float(episodes.area_under_curve(episodes.steps).mean()),
        "eval/intervention_rate": float(episodes.intervention_rate().mean()),
        "eval/collisions": float(episodes.collisions.sum()),
    }
    for level in _LEVELS:
        steps = episodes.steps_to(level / 100)
        reached = steps[~np.isnan(steps)]
        metrics[f"eval/steps_to_{level}"] = float(reached.mean()) if len(reached) else float("nan")
    return metrics
