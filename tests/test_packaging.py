"""What is installed: the wheel's contents and the console script."""

import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import pytest

from forestrl import __version__, cli

ROOT = Path(__file__).resolve().parents[1]
HEAVY = {"gymnasium", "hydra", "matplotlib", "numba", "numpy", "omegaconf", "torch", "wandb"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The contents of the wheel built from this checkout, ``{name: bytes}``."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT]
    subprocess.run(build, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_wheel_contains_the_configuration(wheel):
    conf = {path.relative_to(ROOT).as_posix() for path in (ROOT / "conf").rglob("*.yaml")}
    assert "conf/train.yaml" in conf
    assert {f"forestrl/{name}" for name in conf} <= wheel.keys()


@pytest.mark.parametrize(
    ("room", "one"),
    [("policies", "paper.safetensors"), ("envs/worlds", "stems/LICENSE")],
)
def test_wheel_contains_the_released_policies_and_worlds(wheel, room, one):
    assets = ROOT / "forestrl" / room / "assets"
    files = {path.relative_to(ROOT).as_posix() for path in assets.rglob("*") if path.is_file()}
    assert (assets / one).is_file() and files <= wheel.keys()


def test_wheel_contains_the_package_and_nothing_beside_it(wheel):
    assert {name.split("/")[0].split("-")[0] for name in wheel} == {"forestrl"}
    assert "forestrl/py.typed" in wheel
    assert not [name for name in wheel if "__pycache__" in name]


def test_wheel_installs_the_console_script(wheel):
    (entry_points,) = (text for name, text in wheel.items() if name.endswith("entry_points.txt"))
    assert b"forestrl = forestrl.cli:main" in entry_points


def test_files_outside_the_package_agree_with_it():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    torch = re.search('ARG TORCH="(.+)"', (ROOT / "Dockerfile").read_text())[1]
    assert torch in project["dependencies"]
    assert f"\nversion: {project['version']}\n" in (ROOT / "CITATION.cff").read_text()


def main(monkeypatch, *arguments):
    """Runs ``forestrl`` with these arguments; gives its exit status."""
    monkeypatch.setattr(sys, "argv", ["forestrl", *arguments])
    try:
        cli.main()
    except SystemExit as stop:
        return stop.code
    return 0


@pytest.mark.parametrize("option", ["--help", "-h"])
def test_help_lists_the_commands(option, monkeypatch, capsys):
    assert main(monkeypatch, option) == 0
    output = capsys.readouterr().out
    assert all(f"\n  {name} " in output for name in cli.COMMANDS)


def test_version_is_the_installed_one(monkeypatch, capsys):
    assert main(monkeypatch, "--version") == 0
    assert capsys.readouterr().out == f"forestrl {__version__}\n"


@pytest.mark.parametrize("arguments", [("fly",), ("fly", "--help"), ()])
def test_unknown_command_names_the_allowed_ones(arguments, monkeypatch, capsys):
    assert main(monkeypatch, *arguments) == 2
    (message,) = capsys.readouterr().err.splitlines()
    assert message.endswith("choose one of " + ", ".join(cli.COMMANDS))


def test_command_takes_the_rest_of_the_line(monkeypatch):
    seen = []
    command = SimpleNamespace(main=lambda: seen.append(list(sys.argv)))
    monkeypatch.setattr(cli, "import_module", lambda name: seen.append(name) or command)
    assert main(monkeypatch, "train", "seed=3", "-m") == 0
    assert seen == ["forestrl.train", ["forestrl", "seed=3", "-m"]]


def test_every_command_is_a_module():
    assert [name for name in cli.COMMANDS if find_spec(f"forestrl.{name}") is None] == []


@pytest.mark.parametrize(("argument", "status"), [("--help", 0), ("--version", 0), ("fly", 2)])
def test_command_line_answers_without_heavy_imports(argument, status):
    code = f"""
import atexit, sys
atexit.register(lambda: print("heavy:", *{HEAVY} & sys.modules.keys()))
sys.argv = ["forestrl", "{argument}"]
from forestrl.cli import main
main()
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert result.returncode == status
    assert result.stdout.splitlines()[-1] == "heavy:"
