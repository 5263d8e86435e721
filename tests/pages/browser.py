"""A real browser, and a page opened in it that may neither complain nor ask for anything."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")


@contextmanager
def started() -> Iterator[Any]:
    """Starts a headless Chromium; skips the test where there is none."""
    playwright = pytest.importorskip("playwright.sync_api", reason="NO BROWSER TEST: no playwright")
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        pytest.skip(f"NO BROWSER TEST: none of {', '.join(PROGRAMS)} is installed")
    with playwright.sync_playwright() as tools:
        browser = tools.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield browser
        browser.close()


@contextmanager
def opened(browser: Any, path: Path, hash: str = "#step=0", **options: Any) -> Iterator[Any]:
    """Opens a file; fails at the end if anything went to the console or the network."""
    context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options})
    tab, faults = context.new_page(), []
    tab.on("console", lambda message: faults.append(message.text))
    tab.on("pageerror", lambda error: faults.append(str(error)))
    tab.on("request", lambda request: faults.append(request.url))
    address = f"{path.as_uri()}{hash}"
    tab.goto(address)
    tab.wait_for_function("document.body.dataset.ready")
    yield tab
    asked = [each for each in faults if each not in (address, path.as_uri(), "data:,")]
    context.close()
    assert asked == []
