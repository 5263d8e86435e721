"""What is written about the code is checked against it: references, and the table of keys."""

import ast
import importlib
import re
from pathlib import Path

import pytest
import torch

from forestrl import keys as K
from forestrl.explorer import LinearScore
from tests.envs.worlds import make_transformed

ROOT = Path(__file__).resolve().parents[1]
MODULES = sorted((ROOT / "forestrl").rglob("*.py"))
REFERENCE = re.compile(r":(?:class|func|mod|meth|data|attr):`~?([\w.]+)`")
ROW = re.compile(r"^\| ``(.+?)`` \| .*? \| ``\[\*B(.*?)\]`` (\w+)", re.MULTILINE)
DTYPES = {
    "bool": torch.bool,
    "uint8": torch.uint8,
    "int8": torch.int8,
    "int64": torch.int64,
    "float32": torch.float32,
}


def name_of(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


def references(path):
    """Every reference in a docstring, with the class that it stands in."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    owners = {child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)}
    for node in ast.walk(tree):
        texts = [ast.get_docstring(node)] if isinstance(node, kinds) else []
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            texts.append(node.value.value)
        for text in texts:
            if isinstance(text, str):
                owner = node if isinstance(node, ast.ClassDef) else owners.get(node)
                inside = owner.name if isinstance(owner, ast.ClassDef) else None
                yield from ((reference, inside) for reference in REFERENCE.findall(text))


def resolves(reference, module, inside):
    """Whether a reference names something that is there, seen from where it stands."""
    starts = [module]
    if inside is not None and hasattr(module, inside):
        starts.append(getattr(module, inside))
    for start in starts:
        found = start
        for part in reference.split("."):
            found = getattr(found, part, None)
        if found is not None:
            return True
    head, _, last = reference.rpartition(".")
    for package, attribute in ((reference, None), (head, last)):
        try:
            found = importlib.import_module(package)
        except (ImportError, ValueError):
            continue
        if attribute is None or hasattr(found, attribute):
            return True
    owner, _, klass = head.rpartition(".")
    try:
        return hasattr(getattr(importlib.import_module(owner), klass), last)
    except (ImportError, ValueError, AttributeError):
        return False


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_every_reference_in_a_docstring_resolves(path):
    module = importlib.import_module(name_of(path))
    broken = [found for found, inside in references(path) if not resolves(found, module, inside)]
    assert not broken


def test_there_are_references_to_check():
    assert sum(len(list(references(path))) for path in MODULES) > 50


def test_the_table_of_keys_is_that_of_the_specs():
    """Key, shape and dtype of every row, for those that an env or a planner writes."""
    env = make_transformed(size=(9, 12), num_envs=2)
    state = (
        LinearScore(lidar_range=3.0)
        .make_policy()(env.reset())
        .set(K.UNIFORM, torch.rand(2))
        .set(K.ACTION, torch.zeros(2).long())
    )
    sizes = {"H": 9, "W": 12, "9 + M": 9 + 24, "M": 24}
    found = {}
    for key, shape, dtype in ROW.findall(K.__doc__):
        wanted = [sizes.get(n.strip()) or int(n) for n in shape.split(",") if n.strip()]
        found[ast.literal_eval(key)] = (tuple(wanted), DTYPES[dtype])
    assert len(found) == K.__doc__.count("\n| ``")
    for key, (shape, dtype) in found.items():
        assert (tuple(state[key].shape[1:]), state[key].dtype) == (shape, dtype), key
    named = {
        value
        for name, value in vars(K).items()
        if name.isupper() and name not in ("GRAPH", "PROPOSED", "LOGITS")
    }
    assert named == set(found)


def test_every_entry_of_the_env_is_in_the_table():
    listed = {ast.literal_eval(key) for key, _, _ in ROW.findall(K.__doc__)}
    assert set(make_transformed().observation_spec.keys(True, True)) <= listed
