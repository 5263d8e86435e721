"""Imports point downwards only."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MODULES = sorted((ROOT / "forestrl").rglob("*.py"))

L0 = {"functional", "kernels"}
L1 = {"keys", "paper", "sampling", "settings", "statistics", "status", "storage"}
L1 |= {"arrays", "progress", "stopping", "wording"}
L2 = {"envs", "policies", "planners", "learning"}
STUDIES = {"evaluation", "publishing", "rendering", "pages", "benchmark", "sweeps", "tables"}
L3 = {"config", "command", "loggers", "build", "records", "runs"}
LIGHT = {"config", "command", "settings", "shared"}
L4 = {
    "train",
    "eval",
    "render",
    "collisions",
    "bench",
    "figures",
    "export",
    "dashboard",
    "plan",
    "show",
}
ROOMS = {  # room: the other rooms it may import from
    "": set(),
    "functional": set(),
    "kernels": {"functional"},
    **{name: set() for name in L1},
    "arrays": {"storage"},
    "sampling": {"keys"},
    "settings": {"wording"},
    "signatures": {"settings"},
    "terminal": set(),
    **dict.fromkeys(L2, L0 | L1),
    "explorer": L0 | L1 | {"planners"},
    "released": {"explorer", "policies"},
    "planner": L0 | L1 | L2 | {"", "explorer", "released"},
    "rendering": L0 | L1 | {"envs"},
    "evaluation": L0 | L1 | {"envs", "rendering"},
    "pages": L0 | L1 | {"", "rendering"},
    "gymnasium": {"envs", "functional", "keys", "rendering", "settings"},
    "benchmark": L0 | L1 | L2 | {"explorer", "planner"},
    "tables": {"statistics"},
    "sweeps": {"evaluation", "statistics", "storage", "tables"},
    "publishing": {"evaluation", "paper", "statistics", "sweeps", "tables"},
    "config": {"settings", "signatures", "wording"},
    "help": {"config", "settings", "wording"},
    "records": {"settings", "storage"},
    "runs": {"records", "storage"},
    "command_line": {"config", "help", "records", "runs"},
    "errors": {"config", "wording"},
    "command": {"command_line", "config", "errors", "records", "runs", "settings", "stopping"}
    | {"terminal", "wording"},
    "shared": {"config", "settings"},
    "loggers": {"settings", "storage"},
    "build": L0 | L1 | L2 | STUDIES | {"config", "explorer", "loggers", "records", "released"},
    "jobs": {""} | L0 | L1 | L2 | STUDIES | L3 | {"explorer", "planner", "released"},
    **dict.fromkeys(L4, LIGHT | {"jobs"}),
    "completion": set(),
    "cli": {"", "completion", "terminal"},
}
LIBRARIES = {  # the only libraries of these rooms, besides Python's own
    "": set(),
    "functional": {"torch"},
    "kernels": {"torch", "numba", "numpy"},
    "planners": {"torch", "tensordict", "numba", "numpy"},
    "keys": {"torch", "tensordict"},
    "sampling": {"torch", "tensordict"},
    "paper": set(),
    "settings": set(),
    "signatures": set(),
    "status": set(),
    "stopping": set(),
    "storage": set(),
    "arrays": {"numpy"},
    "statistics": {"numpy", "scipy"},
    "tables": {"tabulate"},
    "terminal": set(),
    "wording": set(),
    "sweeps": {"yaml"},
    "publishing": {"numpy", "pandas", "yaml", "matplotlib"},
    "progress": {"tqdm"},
    "completion": set(),
    "cli": set(),
}
FUNCTIONAL = [  # each row may import from the rows above it
    {"grid"},
    {"actions", "arena"},
    {"frontier", "lidar"},
    {"graph", "paths", "reward"},
    {"__init__"},
]


def imports(path):
    """The dotted names that a module imports, wherever in the file it does so."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: imports are absolute"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def room(name):
    """``forestrl.envs.forest.ForestEnv`` is in ``envs``; ``forestrl.__version__`` in none."""
    return (part := name.split(".")[1]) * (part in ROOMS)


@pytest.fixture(params=MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def module(request):
    path = request.param
    home = path.relative_to(ROOT / "forestrl").with_suffix("").parts[0].replace("__init__", "")
    names = set(imports(path))
    ours = {name for name in names if name.startswith("forestrl.")}
    return path, home, ours, {name.split(".")[0] for name in names - ours}


def test_every_module_is_in_a_room(module):
    assert module[1] in ROOMS


def test_every_room_is_there():
    assert all(
        (ROOT / "forestrl" / name).exists() or (ROOT / f"forestrl/{name}.py").exists()
        for name in ROOMS
    )


def test_rooms_import_from_the_rooms_below(module):
    _, home, ours, _ = module
    assert {room(name) for name in ours} <= ROOMS[home] | {home}


def test_rooms_import_their_libraries_only(module):
    _, home, _, libraries = module
    libraries -= sys.stdlib_module_names
    assert libraries <= LIBRARIES.get(home, libraries)


def test_nothing_below_the_assembler_knows_hydra_or_wandb(module):
    _, home, _, libraries = module
    assert home not in L0 | L1 | L2 | STUDIES or not libraries & {"hydra", "omegaconf", "wandb"}


def test_the_rooms_of_one_floor_meet_through_keys_only():
    assert not any(ROOMS[room] & (L2 - {room}) for room in L2)


def test_no_rooms_import_each_other_in_a_circle():
    reached = {name: set(below) for name, below in ROOMS.items()}
    for _ in ROOMS:
        for below in reached.values():
            below |= set().union(*(reached[name] for name in below))
    assert not [name for name, below in reached.items() if name in below]


def test_functional_modules_are_in_order(module):
    path, home, ours, _ = module
    if home == "functional":
        (row,) = (i for i, names in enumerate(FUNCTIONAL) if path.stem in names)
        allowed = set().union(*FUNCTIONAL[:row])
        assert {name.split(".")[2] for name in ours} <= allowed


def test_no_file_is_long_but_the_passes_of_the_network():
    long = {path.name for path in MODULES if path.read_text("utf-8").count("\n") > 250}
    assert long == {"passes.py"}
