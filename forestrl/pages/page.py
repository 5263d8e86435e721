"""One HTML file that needs nothing else: its style, its program and its data are inside it."""

from __future__ import annotations

import base64
import html
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from forestrl import __version__

_ASSETS = Path(__file__).with_name("assets")
_DATA = re.compile(r'<script type="text/plain" id="data">([^<]*)</script>')
_PLACE = re.compile(r"\{\{(\w+)\}\}")


class Page(str):
    """The text of an HTML page; the last expression of a notebook's cell shows it."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        frame = "width: 100%; height: 860px; border: 0"
        return f'<iframe title="forestrl" style="{frame}" srcdoc="{html.escape(self)}"></iframe>'


def fill(name: str, styles: Sequence[str], scripts: Sequence[str], **parts: str) -> Page:
    """Fills a template in.

    Args:
        name: of the template.
        styles: CSS files, in order.
        scripts: JavaScript files, in order; each may use what those before it define.
        parts: what stands in place of ``{{part}}``; HTML.
    """
    written = {
        "style": "\n".join(asset(each) for each in styles),
        "script": "\n".join(asset(each) for each in scripts),
        "version": __version__,
        **parts,
    }
    return Page(_PLACE.sub(lambda place: written[place[1]], asset(name)))


@cache
def asset(name: str) -> str:
    """Reads a template, style or script of the package."""
    return (_ASSETS / name).read_text(encoding="utf-8")


def packed(data: Mapping[str, Any]) -> str:
    """Packs data into text that can stand anywhere in a page: JSON, deflated, in base 64."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


def unpacked(page: str) -> dict[str, Any]:
    """Reads the data of a page back.

    Raises:
        ValueError: if it is not a page of ours.
    """
    found = _DATA.search(page)
    if found is None:
        raise ValueError("this is not a page with data in it")
    return json.loads(zlib.decompress(base64.b64decode(found[1])))
