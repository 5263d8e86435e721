"""Recorded episodes to test on: of planners, of a small network and of a blind walk."""

from functools import cache

from forestrl.envs import ExplorationGraph
from forestrl.evaluation import arenas
from forestrl.pages import record
from forestrl.planners import NearestFrontier, PathGain
from tests.envs.worlds import forest_env
from tests.evaluation.policies import forest, random_action, random_logits

STEPS = 60


def recorded(policy, env=None, arena=1, steps=STEPS):
    env = forest(1, size=24, n_trees=14) if env is None else env
    td = arenas.draw_arenas(env, 0, [arena])
    return record(env, policy, td, steps=steps, uniforms=arenas.uniforms(0, [arena], steps))


@cache
def of(name):
    """The episode of a policy by name, all in the same arena."""
    policies = {
        "path_gain": lambda: PathGain(lidar_range=5.0),
        "nearest_frontier": NearestFrontier,
        "network": lambda: random_logits,
        "random": lambda: random_action,
    }
    return recorded(policies[name]())


@cache
def colliding():
    """An episode without the filter."""
    env = forest_env(size=24, n_trees=14, num_envs=1)
    return recorded(random_action, env.append_transform(ExplorationGraph(max_frontiers=64)))
