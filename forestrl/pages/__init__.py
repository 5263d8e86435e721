"""Pages to look at episodes and runs: one HTML file each, which asks nothing of the network.

An episode is recorded as plain data, and its page plays it::

    page = episode_page({"nearest frontier": record(env, NearestFrontier(), steps=500)})
    Path("episode.html").write_text(page)
"""

from forestrl.pages.episodes import episode_page, read_episodes
from forestrl.pages.recording import Recording, record

__all__ = ["Recording", "episode_page", "read_episodes", "record"]
