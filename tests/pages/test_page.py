"""Pages: one file each, whose data can be read back."""

import re
from dataclasses import replace

import numpy as np
import pytest

from forestrl.pages import episode_page, read_episodes
from forestrl.pages.page import packed, unpacked
from tests.pages import episodes


def same(one, other):
    assert (one.trees == other.trees).all() and one.steps == other.steps
    for name in ("lidar_range", "coverage_goal", "has_filter", "has_graph"):
        assert getattr(one, name) == getattr(other, name), name
    for step, (left, right) in enumerate(zip(one.moments, other.moments, strict=True)):
        assert (one.map_at(step) == other.map_at(step)).all()
        assert (left.waypoints == right.waypoints).all()
        assert left.coverage == pytest.approx(right.coverage, abs=1e-5)
        assert left.considered.cells == right.considered.cells
        assert left.considered.way == right.considered.way
        for name in ("agent", "feasible", "proposed", "executed", "collided", "status"):
            assert getattr(left, name) == getattr(right, name), name
        assert (left.probability is None) == (right.probability is None)
        if left.probability is not None:
            assert left.probability == pytest.approx(right.probability, abs=5e-4)


@pytest.mark.parametrize("name", ["path_gain", "nearest_frontier", "network", "random"])
def test_a_recording_is_read_back_from_its_page(name):
    recording = episodes.of(name)
    (found,) = read_episodes(episode_page({name: recording})).values()
    same(recording, found)


def test_collisions_and_a_missing_filter_are_read_back():
    recording = episodes.colliding()
    assert any(moment.collided for moment in recording.moments) and not recording.has_filter
    (found,) = read_episodes(episode_page({"blind": recording})).values()
    same(recording, found)


def test_a_page_names_no_other_file_or_address():
    page = episode_page({"a": episodes.of("path_gain")})
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!#|data:)|https?://|@import|url\(""", page)
    assert "default-src 'none'" in page


def test_names_and_titles_cannot_break_out_of_the_page():
    wild = "</script><img src=x onerror=alert(1)>"
    page = episode_page({wild: episodes.of("random")}, title=wild, about={wild: wild})
    assert "<img" not in page and list(read_episodes(page)) == [wild]


def test_episodes_of_different_arenas_do_not_stand_side_by_side():
    other = episodes.colliding()
    apart = replace(other, trees=np.zeros((5, 5), bool))
    with pytest.raises(ValueError, match="same arena"):
        episode_page({"a": other, "b": apart})
    with pytest.raises(ValueError, match="needs a recording"):
        episode_page({})


def test_data_is_packed_and_unpacked():
    data = {"a": [1, 2.5, None], "b": "</script> é"}
    text = packed(data)
    assert re.fullmatch(r"[A-Za-z0-9+/=]+", text)
    assert unpacked(f'<script type="text/plain" id="data">{text}</script>') == data
    with pytest.raises(ValueError, match="not a page"):
        unpacked("<p>nothing</p>")


def test_a_notebook_shows_the_page_in_a_frame():
    page = episode_page({"a": episodes.of("random")})
    assert page._repr_html_().startswith("<iframe") and "srcdoc" in page._repr_html_()
