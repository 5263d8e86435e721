"""The site: builds without a warning, loads nothing from elsewhere, and has no dead link."""

from __future__ import annotations

import re
import subprocess
import sys
from html.parser import HTMLParser
from importlib import import_module
from urllib.parse import unquote, urlsplit

import pytest

from forestrl.cli import COMMANDS
from tests.docs.pages import ROOT

pytestmark = pytest.mark.slow
LOADS = {"src", "srcset", "data", "poster"}
"""Attributes that a browser fetches by itself; and ``href`` of ``link``."""


class Page(HTMLParser):
    """What a page links to, what it loads, and what in it can be linked to."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.anchors = [], [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id":
                self.anchors.add(value)
            elif name in LOADS or (tag == "link" and name == "href"):
                self.loads.append(value)
            elif tag == "a" and name == "href":
                self.links.append(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-E", "-d"]
    command += [str(folder / "cache"), str(ROOT / "docs"), str(folder / "html")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}


def dead(pages, path, link):
    """Whether a link of a page leads to a file or an anchor that is not there."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return False
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if not target.is_file():
        return True
    return (
        bool(parts.fragment)
        and target in pages
        and (unquote(parts.fragment) not in pages[target].anchors)
    )


def test_no_link_is_dead(pages):
    links = [(path, link) for path, page in pages.items() for link in page.links + page.loads]
    assert len(links) > 1000
    assert {(path.name, link) for path, link in links if dead(pages, path, link)} == set()


def test_a_page_loads_nothing_from_elsewhere(site, pages):
    loads = {load for page in pages.values() for load in page.loads}
    assert not {load for load in loads if re.match(r"(\w+:)?//", load)}
    styles = [path.read_text(encoding="utf-8") for path in site.rglob("*.css")]
    assert styles and not re.search(r"(@import|url\()\s*[\"']?(https?:)?//", "".join(styles))


def test_formulas_are_drawn_and_none_is_left_as_it_was_typed(site):
    text = (site / "concepts.html").read_text(encoding="utf-8")
    assert text.count("<math xmlns") + text.count("<math ") > 20
    assert not re.search(r"\\(frac|begin|sum|Phi|mathcal)", text)


def test_every_command_and_option_has_its_settings_explained(site):
    text = re.sub(r"<[^>]+>", "", (site / "settings.html").read_text(encoding="utf-8"))
    for command in COMMANDS:
        assert f"forestrl {command}" in text
    for path in (ROOT / "conf").glob("*/*.yaml"):
        assert f"{path.parent.name}={path.stem}" in text or path.stem == "base", path
    assert "discount factor" in text and "a number from 0 to 1" in text


def test_what_the_packages_export_is_in_the_reference(pages):
    anchors = set().union(*(page.anchors for page in pages.values()))
    packages = ["functional", "envs", "planners", "evaluation", "rendering", "explorer"]
    for package in [*packages, "policies.gatv2"]:
        module = import_module(f"forestrl.{package}")
        undocumented = {"FEATURES", "NULL_ACTION", "WAYPOINTS", "DISPLACEMENTS", "WAYPOINT_EDGES"}
        names = {f"{module.__name__}.{name}" for name in module.__all__}
        names -= {f"forestrl.functional.{name}" for name in undocumented}
        assert names <= anchors, names - anchors
