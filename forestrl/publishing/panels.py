"""All figures, drawable or not."""

from __future__ import annotations

from forestrl.publishing.figure3 import fig3a, fig3b, fig3c
from forestrl.publishing.figure4 import fig4a, fig4b, fig4c
from forestrl.publishing.panel import Panel
from forestrl.publishing.results import Results


def panels(results: Results, policy: str) -> dict[str, Panel | str]:
    """Gives every figure, or the files that it wants where there is nothing to draw.

    Args:
        results: what was read.
        policy: name of the learned policy.
    """
    makers = (fig3a, fig3b, fig3c, fig4a, fig4b, fig4c)
    return {make.__name__: make(results, policy) for make in makers}
