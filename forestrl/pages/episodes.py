"""The page of an episode: of one policy, or of several side by side."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

import numpy as np

from forestrl.pages.comparing import falls_behind
from forestrl.pages.encoding import decode, encode
from forestrl.pages.page import Page, fill, packed, unpacked
from forestrl.pages.recording import Recording

STYLES = ("look.css", "episode.css")
SCRIPTS = ("common.js", "chart.js", "episode.js", "arena.js", "decision.js", "card.js", "player.js")


def episode_page(
    recordings: Mapping[str, Recording],
    *,
    title: str = "An episode",
    about: Mapping[str, str] | None = None,
) -> Page:
    """Writes the page that plays episodes in the same arena, side by side and in step.

    Args:
        recordings: by the policies' names.
        title: of the page.
        about: what else is to be known of them, such as the command that made the page.

    Raises:
        ValueError: if there is no recording, or they are not of the same arena.
    """
    data = packed(episode_data(recordings, title, about or {}))
    return fill("episode.html", STYLES, SCRIPTS, title=html.escape(title), data=data)


def episode_data(
    recordings: Mapping[str, Recording], title: str, about: Mapping[str, str]
) -> dict[str, Any]:
    """Gives what an episode's page is drawn from."""
    if not recordings:
        raise ValueError("a page needs a recording")
    first = next(iter(recordings.values()))
    if not all(np.array_equal(each.trees, first.trees) for each in recordings.values()):
        raise ValueError("episodes side by side are of the same arena")
    behind = falls_behind([each.coverage for each in recordings.values()], first.coverage_goal)
    return {
        "title": title,
        "about": [[name, value] for name, value in about.items()],
        "behind": behind,
        "episodes": [{"name": name, **encode(each)} for name, each in recordings.items()],
    }


def read_episodes(page: str) -> dict[str, Recording]:
    """Reads the recordings of an episode's page back, by the policies' names."""
    return {each["name"]: decode(each) for each in unpacked(page)["episodes"]}
