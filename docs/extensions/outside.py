"""Pages whose text stands elsewhere in the repository: README, changelog, the table of keys."""

from __future__ import annotations

import ast
import os
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PAGES = {  # page: where its text is
    "index": "README.md",
    "changelog": "CHANGELOG.md",
    "contributing": "CONTRIBUTING.md",
    "speed": "multirun/results/speed.md",
}
_LINK = re.compile(r'(\]\(|\b(?:src|href)=")(?![a-z]+:|[#/])([^)"#\s]+)')


def read(app: Any, name: str, source: list[str]) -> None:
    """Gives a page its text, and leads its links to the pages of the site."""
    path = PAGES.get(name, f"docs/{name}.md")
    if name in PAGES:
        own = source[0].partition("<!-- text -->")[2]  # what the site says besides
        source[0] = (ROOT / path).read_text(encoding="utf-8") + own
    if name == "api/keys":
        source[0] += ast.get_docstring(ast.parse((ROOT / "forestrl/keys.py").read_text())) or ""
    source[0] = with_links(source[0], path, f"docs/{name}.md")


def with_links(text: str, path: str, page: str) -> str:
    """Rewrites links that are relative to a file so that they hold on a page.

    Args:
        text: Markdown.
        path: the file that it was written in, from the repository's root.
        page: the page that shows it, likewise.
    """
    pages = {where: f"docs/{name}.md" for name, where in PAGES.items()}

    def moved(match: re.Match[str]) -> str:
        target = os.path.normpath(os.path.join(os.path.dirname(path), match[2]))
        if not (ROOT / target).exists():
            return match[0]
        return match[1] + os.path.relpath(pages.get(target, target), os.path.dirname(page))

    return _LINK.sub(moved, text)


def setup(app: Any) -> dict[str, bool]:
    """Reads the pages' texts from where they are."""
    app.connect("source-read", read)
    return {"parallel_read_safe": True}
