"""The learned explorer: candidates to walk to, a network that compares them, and its training."""

from forestrl.explorer.network import LinearScore, ViewpointGATv2
from forestrl.explorer.policy import ViewpointPolicy

__all__ = ["LinearScore", "ViewpointGATv2", "ViewpointPolicy"]
