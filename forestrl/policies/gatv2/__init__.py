"""The paper's networks: two GATv2 layers over the exploration graph, compiled for the CPU."""

from forestrl.policies.gatv2.network import Critic, GATv2ActorCritic, GATv2Encoder

__all__ = ["Critic", "GATv2ActorCritic", "GATv2Encoder"]
