"""How a policy improves: PPO, what is measured on the way, and exact checkpoints."""
