"""The TensorDict schema: every key that two places share, once.

Groups say whose knowledge an entry is. ``*B`` is the env's batch, ``H`` and ``W`` are rows and
columns of the arena (the paper's ``h``), ``M`` is the room for frontier nodes.

| key | symbol | shape, dtype | written by |
|---|---|---|---|
| ``("arena", "trees")`` | M | ``[*B, H, W]`` bool, hidden truth | ForestEnv |
| ``("arena", "traversable")`` | under rho | ``[*B, H, W]`` bool, hidden truth | ForestEnv |
| ``("map", "cells")`` | M^a_t | ``[*B, H, W]`` uint8, ``Cell`` | ForestEnv |
| ``("agent", "position")`` | p^t | ``[*B, 2]`` int64 (row, col) | ForestEnv |
| ``("exploration", "new_cells")`` | n^e_t | ``[*B, 1]`` float32 | ForestEnv |
| ``("exploration", "coverage")`` | rho_t | ``[*B, 1]`` float32 in [0, 1] | ForestEnv |
| ``("safety", "collision")`` | - | ``[*B, 1]`` bool | ForestEnv |
| ``"step_count"`` | n_s | ``[*B, 1]`` int64 | ForestEnv |
| ``("safety", "feasible")`` | A^f and a^0 | ``[*B, 9]`` bool | SafetyFilter |
| ``("safety", "executed")`` | u^sigma | ``[*B]`` int64, read under ``"next"`` | SafetyFilter |
| ``("safety", "intervened")`` | u^pi != u^sigma | ``[*B, 1]`` bool, as above | SafetyFilter |
| ``("graph", "x")`` | x_v | ``[*B, 9 + M, 8]`` float32 | ExplorationGraph |
| ``("graph", "waypoint")`` | v*_n (Eq. 2) | ``[*B, M]`` int64, 1 to 8 | ExplorationGraph |
| ``("graph", "length")`` | its length / l | ``[*B, M]`` float32 | ExplorationGraph |
| ``("graph", "frontiers")`` | number of frontier cells | ``[*B, 1]`` int64 | ExplorationGraph |
| ``("exploration", "potential")`` | Phi(s_t) | ``[*B, 1]`` float32 | FrontierPotentialReward |
| ``"action"`` | u^pi at the root | ``[*B]`` int64, 0 to 8 | policy |
| ``("planner", "status")`` | - | ``[*B]`` int8, ``Status`` | classical planners |
| ``("planner", "guarded")`` | - | ``[*B]`` bool, the guard against cycles chose | explorer |
| ``"uniform"`` | - | ``[*B]`` float32, one draw an arena to sample with | evaluation |

``"reward"`` is n^e_t from ForestEnv and r_t (Eq. 6) after FrontierPotentialReward; ``"done"``,
``"terminated"`` (rho >= rho*), ``"truncated"`` (n_s >= n_s*), ``"logits"``, ``"action_log_prob"``,
``"state_value"``, ``"advantage"``, ``"value_target"``, ``"episode_reward"`` keep TorchRL's names.
Training adds ``"horizon"``; planners keep what they remember under ``"planner"``.
"""

TREES = ("arena", "trees")
TRAVERSABLE = ("arena", "traversable")
CELLS = ("map", "cells")
POSITION = ("agent", "position")
NEW_CELLS = ("exploration", "new_cells")
COVERAGE = ("exploration", "coverage")
POTENTIAL = ("exploration", "potential")
FEASIBLE = ("safety", "feasible")
EXECUTED = ("safety", "executed")
INTERVENED = ("safety", "intervened")
COLLISION = ("safety", "collision")
NODES = ("graph", "x")
WAYPOINT = ("graph", "waypoint")
LENGTH = ("graph", "length")
FRONTIERS = ("graph", "frontiers")
GRAPH = (NODES, WAYPOINT, LENGTH, FRONTIERS)
"""What the policy and the critic read."""

PROPOSED = ("safety", "proposed")
"""u^pi on its way through one step; never leaves the filter."""
STEP_COUNT = "step_count"
ACTION = "action"
LOGITS = "logits"
UNIFORM = "uniform"
STATUS = ("planner", "status")
GUARDED = ("planner", "guarded")
