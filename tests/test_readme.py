"""What the README says is so."""

import re
import shlex
from importlib import import_module
from pathlib import Path

import pytest

from forestrl.cli import COMMANDS
from tests.commands import compose

README = Path(__file__).parents[1] / "README.md"
TEXT = README.read_text(encoding="utf-8")
SHELL = "\n".join(re.findall(r"```bash\n(.*?)```", TEXT, re.DOTALL))


def typed_commands():
    """The ``forestrl`` commands in the README, as lists of words without options."""
    for line in SHELL.splitlines():
        for part in re.split(r"&&|;", line.partition(" #")[0]):
            words = shlex.split(part)
            if "forestrl" in words and words.index("forestrl") + 1 < len(words):
                command, *rest = words[words.index("forestrl") + 1 :]
                if command in COMMANDS:
                    yield command, [word for word in rest if "=" in word]


@pytest.mark.parametrize(("command", "overrides"), list(typed_commands()), ids=str)
def test_a_command_is_configured_as_it_is_typed(command, overrides):
    single = [re.sub(r"=([^\[,]*),.*", r"=\1", override) for override in overrides]
    assert compose(command, *single)


def test_every_command_is_shown():
    assert {command for command, _ in typed_commands()} == set(COMMANDS)


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`(forestrl(?:\.\w+)+)`", TEXT))))
def test_a_name_in_the_readme_is_there(name):
    parts = name.split(".")
    for split in range(len(parts), 0, -1):
        try:
            found = import_module(".".join(parts[:split]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[split:]:
            found = getattr(found, attribute)
        return
    pytest.fail(f"{name} is nowhere")


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`((?:conf|forestrl)/[\w/.]+)`", TEXT))))
def test_a_path_in_the_readme_is_there(path):
    if "new" not in path:
        assert (README.parent / path).exists()


def test_the_python_example_runs():
    (example,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    exec(compile(example, str(README), "exec"), {})
