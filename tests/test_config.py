"""``conf/``: everything composes, is constructed, states the constructors' defaults, and trains."""

import inspect
from inspect import isclass
from itertools import product
from pathlib import Path

import pytest
from hydra.utils import get_object, instantiate
from omegaconf import DictConfig, ListConfig, OmegaConf

from forestrl import build
from forestrl.cli import COMMANDS
from forestrl.config import CONF_DIR
from forestrl.jobs.train import Training
from forestrl.loggers import NoLogger, Run
from forestrl.policies.gatv2 import GATv2ActorCritic
from forestrl.progress import Progress
from tests.commands import compose

CONF = Path(CONF_DIR)
PRIMARIES = sorted(path.stem for path in CONF.glob("*.yaml") if path.stem != "world")
OPTIONS = sorted(
    (path.parent.name, path.stem)
    for path in CONF.glob("*/*.yaml")
    if path.parent.name not in ("experiment", "ablation")
)
SEARCHES = {"explorer", "linear"}
EXPERIMENTS = sorted({path.stem for path in (CONF / "experiment").glob("*.yaml")} - SEARCHES)
ABLATIONS = {  # what each changes
    "none": {},
    "no_filter": {"safety._target_": None},
    "no_potential": {"reward.shaping": False},
    "no_edge_lengths": {"model.edge_lengths": False},
    "no_entropy": {"algo.entropy_coeff": 0.0},
    "beta_0.0": {"reward.beta": 0.0},
    "beta_0.25": {"reward.beta": 0.25},
    "beta_1.0": {"reward.beta": 1.0},
}
SWEEPS = {
    "ablations": [
        (f"ablation={name}", f"seed={seed}") for name, seed in product(ABLATIONS, range(3))
    ],
    "beta": [
        (f"reward.beta={beta}", f"seed={seed}")
        for beta, seed in product(("0.25", "0.5", "1.0"), range(3))
    ],
    "density": [
        (f"env.n_trees={trees}", f"seed={seed}") for trees, seed in product((45, 60, 75), range(3))
    ],
    "size": [
        (f"env={env}", f"seed={seed}")
        for env, seed in product(("forest", "forest75", "forest100"), range(3))
    ],
}
EXEMPT = {"num_envs", "seed", "device", "world"}
GIVEN = {"run", "models", "settings"}  # by the assembler
REQUIRED = {"start"}  # no default in Python
SHORT = {"size", "n_trees", "tree_radius"}  # env's names for the settings of its world
VARIANTS = {
    ("env", "tiny"),
    ("env", "forest75"),
    ("env", "forest100"),
    ("reward", "coverage"),
    ("policy", "information_gain_tuned"),
    ("policy", "linear"),
    ("policy", "paper"),
}
TWO_TINY_BATCHES = (
    "env.size=14",
    "env.n_trees=4",
    "env.tree_radius=[1.0,1.5]",
    "env.num_envs=4",
    "total_frames=64",
    "episode_steps=10",
    "algo.frames_per_batch=32",
    "algo.num_minibatches=4",
    "graph.max_frontiers=64",
    "checkpoint_every=0",
    "eval.every=64",
    "eval.arenas=2",
    "eval.steps=5",
)


def primary_of(group):
    return "eval" if group == "policy" else "train"


def node_of(group, option):
    """The group's part of the whole configuration, with this option chosen."""
    return compose(primary_of(group), f"{group}={option}")[group]


def test_everything_was_found():
    assert {"train", "eval", "render"} <= set(PRIMARIES) == set(COMMANDS)
    groups = {"env", "safety", "graph", "reward", "model", "algo", "policy", "logger"}
    assert {group for group, _ in OPTIONS} == groups
    assert {"paper", "beta", "density", "size", "smoke"} <= set(EXPERIMENTS)


@pytest.mark.parametrize("name", PRIMARIES)
def test_every_command_has_a_whole_configuration(name):
    cfg = compose(name)
    OmegaConf.to_container(cfg, resolve=True, throw_on_missing=True)
    if name != "figures":  # it only reads files
        assert {"env", "safety", "graph", "reward", "model", "seed", "device"} <= cfg.keys()


def test_names_that_people_rely_on():
    cfg = compose("train", "env.n_trees=75", "reward.beta=0.25", "env.size=75")
    assert (cfg.env.n_trees, cfg.reward.beta, cfg.env.size) == (75, 0.25, 75)


@pytest.mark.parametrize(("group", "option"), OPTIONS)
def test_every_option_can_be_constructed(group, option, tmp_path):
    node = node_of(group, option)
    if node.get("_target_") is None:
        assert (group, option) == ("safety", "none")
    elif group == "env":
        assert build.make_forest(compose("train", f"env={option}")).world.shape
    elif group == "logger":
        if option != "wandb":  # it would start a process
            instantiate(node, Run(tmp_path))
    elif group == "algo":
        networks = GATv2ActorCritic()
        instantiate(node, *([networks.make_actor(), networks.make_critic()] * (option == "ppo")))
    else:
        instantiate({key: value for key, value in node.items() if key != "name"})


CONSTRUCTED = [option for option in OPTIONS if node_of(*option).get("_target_") is not None]


def defaults_of(node):
    """Names and defaults of a class's own constructor, what code has to give it aside."""
    target = get_object(node["_target_"])
    constructor = vars(target).get("__init__", lambda: None) if isclass(target) else target
    parameters = inspect.signature(constructor).parameters.values()
    defaults = {p.name: p.default for p in parameters if p.default is not inspect.Parameter.empty}
    return {name: default for name, default in defaults.items() if name not in GIVEN}


@pytest.mark.parametrize(("group", "option"), CONSTRUCTED)
def test_keys_are_the_constructors_arguments(group, option):
    node = node_of(group, option)
    short = SHORT if group == "env" else set()
    assert node.keys() - {"_target_", "name"} - short - REQUIRED == defaults_of(node).keys()


def test_the_worlds_settings_go_by_short_names():
    cfg = compose("train", "env.size=[20,30]", "env.n_trees=7", "env.tree_radius=[0.5,1.5]")
    world = build.make_forest(cfg).world
    assert (world.shape, world.n_trees, world.tree_radius) == ((20, 30), 7, (0.5, 1.5))
    assert dict(compose("train").env.world) == {
        "_target_": "forestrl.envs.RandomForest",
        "shape": 50,
        "n_trees": 45,
        "tree_radius": [1.0, 3.0],
    }


@pytest.mark.parametrize(
    ("group", "option"), [option for option in CONSTRUCTED if option not in VARIANTS]
)
def test_values_are_the_constructors_defaults(group, option):
    node = node_of(group, option)
    elsewhere = {name for name in node if OmegaConf.is_interpolation(node, name)}
    for name, default in defaults_of(node).items():
        if default is None and name in elsewhere:  # left open in Python, said once in YAML
            continue
        value = tuple(node[name]) if isinstance(node[name], ListConfig) else node[name]
        assert value == default or name in EXEMPT, name


def test_one_place_per_fact():
    cfg = compose("train", "graph.window=9", "env.coverage_goal=0.9", "env.lidar_range=6.0")
    assert cfg.reward.window == 9
    assert cfg.reward.coverage_goal == 0.9
    assert cfg.graph.lidar_range == cfg.model.lidar_range == 6.0
    assert compose("train", "seed=5").env.seed == 5


@pytest.mark.parametrize("name", PRIMARIES)
def test_nothing_but_hydras_own_node_needs_a_running_command(name):
    text = OmegaConf.to_yaml(compose(name))
    assert not any(resolver in text for resolver in ("${hydra:", "${oc.env:", "${now:"))


def sweep(experiment):
    """The jobs of an experiment: the overrides of each, one job if it is no sweep."""
    cfg = compose("train", f"experiment={experiment}", return_hydra_config=True)
    if cfg.hydra.mode is None:
        return [()]
    assert cfg.hydra.mode.name == "MULTIRUN"
    assert cfg.hydra.sweep.dir == f"multirun/{experiment}"
    values = [
        [f"{name}={value}" for value in str(values).split(",")]
        for name, values in cfg.hydra.sweeper.params.items()
    ]
    return list(product(*values))


def test_sweeps_expand_to_their_grids():
    found = {name: sweep(name) for name in EXPERIMENTS}
    assert {name: jobs for name, jobs in found.items() if len(jobs) > 1} == SWEEPS


def test_an_ablation_changes_one_thing():
    assert {path.stem for path in (CONF / "ablation").glob("*.yaml")} == ABLATIONS.keys()
    whole = leaves(compose("train"))
    for name, changes in ABLATIONS.items():
        assert leaves(compose("train", f"ablation={name}")) == whole | changes, name


def leaves(node, prefix=""):
    """Every value of a configuration by its dotted name."""
    found = {}
    for key, value in node.items():
        name = f"{prefix}{key}"
        found |= leaves(value, f"{name}.") if isinstance(value, DictConfig) else {name: value}
    return found


JOBS = [
    *(
        (name, job)
        for name in EXPERIMENTS
        for job in dict.fromkeys((sweep(name)[0], sweep(name)[-1]))
    ),
    *(("ablations", (f"ablation={name}",)) for name in ABLATIONS),
]


@pytest.mark.parametrize(("experiment", "job"), JOBS)
def test_every_experiment_composes(experiment, job):
    cfg = compose("train", f"experiment={experiment}", *job)
    for override in job:
        name, value = override.split("=")
        if name not in ("env", "ablation"):
            assert str(OmegaConf.select(cfg, name)) == value
    if experiment == "ablations":  # measured at the end, and only there
        assert cfg.total_frames == cfg.eval.every == 50 * cfg.algo.frames_per_batch
    elif experiment != "smoke":
        assert cfg.total_frames == 400_000


def test_larger_arenas_have_trunks_in_proportion_and_room_for_their_frontiers():
    for env, size, trees in (("forest75", 75, 101), ("forest100", 100, 180)):
        cfg = compose("train", "experiment=size", f"env={env}")
        assert (cfg.env.size, cfg.env.n_trees) == (size, trees)
        assert cfg.env.n_trees == pytest.approx(45 * (size / 50) ** 2, abs=0.5)
        assert cfg.graph.max_frontiers == 768
        assert cfg.env.max_steps == 10_000


@pytest.mark.parametrize(("experiment", "job"), JOBS)
def test_every_experiment_trains(experiment, job, tmp_path):
    cfg = compose("train", f"experiment={experiment}", *job, *TWO_TINY_BATCHES)
    training = Training(cfg, tmp_path)
    with Progress(training.total_frames) as bar:
        metrics = training.run(NoLogger(), bar)
    training.collector.shutdown()
    assert training.frames == 64
    assert metrics["eval/coverage"] > 0
    assert metrics["safety/collisions"] == 0 or "ablation=no_filter" in job
    assert (tmp_path / "checkpoints/best/policy.safetensors").is_file()
