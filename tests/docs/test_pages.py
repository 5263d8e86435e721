"""What the README and the pages say is so: commands, code, files, names and paths."""

from __future__ import annotations

import re
import runpy
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
import yaml

from forestrl.cli import COMMANDS
from forestrl.config import check_all
from tests.commands import compose, forestrl
from tests.docs.pages import (
    PAGES,
    ROOT,
    blocks,
    forestrl_words,
    forget_modules,
    is_run,
    lines,
    read,
)

PROGRAMS = {"docker", "git", "pip", "pre-commit", "pytest", "python", "source", "sphinx-build"}
PROGRAMS |= {"cd", "tensorboard", "wandb", ".ci/run"}
LEFT_BEHIND = {  # by a page that is run: file and words in it
    "docs/extend.md": {
        "hurried/metrics.csv": "reward/price",
        "my_run/metrics.csv": "\n2048,",
        "logged/metrics.jsonl": '"frames": 1024',
        "multirun/mine/table.md": "reward.beta=1.0",
    },
}
NO_SETTINGS = {"env.step"}


def commands(page):
    """All shell lines of a page."""
    return [line for block in blocks(page) if block.kind == "bash" for line in lines(block)]


COMPOSED = [
    (page, words)
    for page in PAGES
    for line in commands(page)
    if (words := forestrl_words(line.words))
    and not (is_run(page) and line.runs)
    and not words[0].startswith("-")
    and "--config-dir" not in words
]


@pytest.mark.parametrize(("page", "words"), COMPOSED, ids=str)
def test_a_command_is_allowed_as_it_is_typed(page, words):
    name, *overrides = words
    given = [re.sub(r"=([^\[,]*),.*", r"=\1", word) for word in overrides if "=" in word]
    asked = {word.partition("=")[0] for word in given if not word.startswith("hydra.")}
    check_all(compose(name, *given), import_module(f"forestrl.{name}").Settings, asked)


QUICK = ("docs/extend.md",)


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.slow if page in QUICK else pytest.mark.heavy)
        for page in PAGES
        if is_run(page)
    ],
)
def test_a_page_runs_from_top_to_bottom(page, tmp_path, monkeypatch):
    """Its files are written, its commands and its Python run, in the order they stand in."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setenv("WANDB_MODE", "offline")
    names = {}
    for block in blocks(page):
        if block.file:
            path = tmp_path / block.file
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("a") as file:
                file.write(block.text)
        elif block.kind == "python":
            exec(compile(block.text, page, "exec"), names)
        for line in lines(block) if block.kind == "bash" else ():
            forget_modules(tmp_path)
            if line.runs and (words := forestrl_words(line.words)):
                result = forestrl(*words)
                assert result.status == 0, f"{' '.join(words)}\n{result.err}"
            elif line.words[0] == "python" and line.words[1].endswith(".py"):
                runpy.run_path(line.words[1])
    forget_modules(tmp_path)
    for name, words in LEFT_BEHIND.get(page, {}).items():
        assert words in (tmp_path / name).read_text()


@pytest.mark.parametrize("page", [page for page in PAGES if not is_run(page)])
def test_python_on_a_page_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks(page):
        if block.kind == "python":
            exec(compile(block.text, page, "exec"), names)


@pytest.mark.parametrize("page", PAGES)
def test_configuration_on_a_page_is_yaml(page):
    for block in blocks(page):
        if block.kind == "yaml":
            assert yaml.safe_load(block.text), block.text


@pytest.mark.parametrize("page", PAGES)
def test_a_page_asks_for_programs_and_extras_that_there_are(page):
    extras = tomllib.loads(read("pyproject.toml"))["project"]["optional-dependencies"]
    for words, _ in commands(page):
        assert words[0] in PROGRAMS | {"forestrl"}, words
    for names in re.findall(r"pip install[^`\n]*?\[([\w,]+)\]", read(page)):
        assert set(names.split(",")) <= set(extras), names


def test_every_command_is_shown_in_the_readme():
    shown = {words[0] for line in commands("README.md") if (words := forestrl_words(line.words))}
    assert set(COMMANDS) <= shown


@pytest.mark.parametrize("page", PAGES)
def test_names_on_a_page_are_there(page):
    missing = [
        name for name in re.findall(r"`(forestrl(?:\.\w+)+)`", read(page)) if not found(name)
    ]
    assert not missing


def found(name):
    """Whether a dotted name is a module's or something in one."""
    parts = name.split(".")
    for split in range(len(parts), 0, -1):
        try:
            thing = import_module(".".join(parts[:split]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[split:]:
            thing = getattr(thing, attribute, None)
        return thing is not None
    return False


@pytest.mark.parametrize("page", PAGES)
def test_paths_on_a_page_are_there(page):
    paths = re.findall(r"`((?:conf|forestrl|docs|tests)/[\w/.]*)`", read(page))
    assert not [path for path in paths if not (ROOT / path).exists()]


@pytest.mark.parametrize("page", PAGES)
def test_settings_on_a_page_are_there(page):
    """``env.n_trees`` and ``reward=coverage`` in the running text, or in its own files."""
    own = {Path(each.file).relative_to("my_conf"): each.text for each in yaml_files(page)}
    conf = ROOT / "conf"
    known = {path.relative_to(conf): path.read_text() for path in conf.rglob("*.yaml")} | own
    groups = "|".join(sorted({path.parent.name for path in known} - {""}))
    settings = {name for path, text in known.items() for name in names_in(path, text)}
    for name in re.findall(rf"`((?:{groups})\.\w[\w.]*)(?:=[^`]*)?`", read(page)):
        assert name in settings | NO_SETTINGS
    for group, option in re.findall(rf"`({groups})=(\w+)`", read(page)):
        assert Path(group, f"{option}.yaml") in known


def yaml_files(page):
    return [each for each in blocks(page) if each.kind == "yaml" and each.file]


def names_in(path, text):
    """The dotted names of the settings in a file of the configuration."""

    def walk(node, above):
        for key, value in (node or {}).items():
            yield f"{above}{key}"
            if isinstance(value, dict):
                yield from walk(value, f"{above}{key}.")

    group = path.parent.name
    return walk(yaml.safe_load(text), f"{group}." if group else "")


def test_there_are_pages_of_both_kinds():
    assert len(COMPOSED) > 15 and sum(map(is_run, PAGES)) >= 6
