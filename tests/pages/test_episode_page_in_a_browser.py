"""The page of an episode, opened in a real browser."""

import numpy as np
import pytest

from forestrl.functional import Cell
from forestrl.pages import episode_page
from tests.pages import episodes
from tests.pages.browser import opened, started

pytestmark = pytest.mark.browser
CLEAR = 8  # cells from the robot: farther than the sensor, the arrow and its goal's ring
CORNERS = """view => {
  const canvas = document.querySelector(`article canvas[data-view=${view}]`);
  const pen = canvas.getContext("2d"), { width, height } = canvas, side = SIDE;
  const { data } = pen.getImageData(0, 0, width, height);
  return Array.from({ length: side * side }, (_, cell) => {
    const [row, col] = [Math.floor(cell / side), cell % side];
    const x = Math.floor((col + 0.12) * width / side), y = Math.floor((row + 0.12) * height / side);
    return Array.from(data.slice(4 * (y * width + x), 4 * (y * width + x) + 3));
  });
}"""


@pytest.fixture(scope="module")
def browser():
    with started() as found:
        yield found


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")

    def write(*names):
        path = folder / f"{'-'.join(names)}.html"
        if not path.exists():
            path.write_text(episode_page({name: episodes.of(name) for name in names}))
        return path

    return write


def state(tab):
    return tab.evaluate("player.then(({ step, playing, view }) => ({ step, playing, view }))")


def step(tab):
    return state(tab)["step"]


def paints(tab, *names):
    return [
        [int(paint[i : i + 2], 16) for i in (1, 3, 5)]
        for paint in tab.evaluate("names => names.map(colour)", list(names))
    ]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("at", [55, 0, 31, 32])
def test_scrubbing_to_a_step_shows_the_map_of_that_step(browser, pages, scheme, at):
    recording = episodes.of("nearest_frontier")
    side, seen = len(recording.trees), recording.map_at(at)
    far = np.abs(np.indices(seen.shape).T - recording.moments[at].agent).max(-1).T > CLEAR
    for moment in recording.moments[: at + 1]:  # the way covers a cell's corner as well
        row, col = moment.agent
        far[max(0, row - 1) : row + 2, max(0, col - 1) : col + 2] = False
    with opened(browser, pages("nearest_frontier"), color_scheme=scheme) as tab:
        tab.locator("#scrub").fill(str(at))
        drawn = np.array(tab.evaluate(CORNERS.replace("SIDE", str(side)), "map"))
        drawn = drawn.reshape(side, side, 3)
        unknown, free, trunk, border = paints(tab, "unknown", "free", "trunk", "frontier")
    assert len({tuple(paint) for paint in (unknown, free, trunk, border)}) == 4
    padded = np.pad(seen == Cell.UNKNOWN, 1)
    near = sum(padded[i : i + side, j : j + side].astype(int) for i in range(3) for j in range(3))
    frontier = (seen == Cell.FREE) & (near > 0)
    inside = (seen == Cell.FREE) & ~frontier
    for cells, paint in (
        (seen == Cell.UNKNOWN, unknown),
        (seen == Cell.OCCUPIED, trunk),
        (frontier, border),
        (inside, free),
    ):
        assert (drawn[cells & far] == paint).all()
    assert (far & (seen == Cell.UNKNOWN)).sum() > 50


def test_the_page_keeps_the_map_of_every_step_in_whatever_order_they_are_asked_for(browser, pages):
    recording = episodes.recorded(episodes.random_action, steps=200)
    path = pages("random").with_name("long.html")
    path.write_text(episode_page({"random": recording}))
    order = [0, 200, 3, 127, 128, 64, 63, 199, 0, 200]
    ask = "step => player.then(({ episodes }) => Array.from(episodes[0].mapAt(step)))"
    with opened(browser, path) as tab:
        for at in order:
            assert tab.evaluate(ask, at) == recording.map_at(at).reshape(-1).tolist(), at


def test_the_page_plays_to_the_end_and_stops_there(browser, pages):
    with opened(browser, pages("network", "nearest_frontier")) as tab:
        tab.locator("#speed").select_option("120")
        tab.locator("#play").click()
        assert state(tab)["playing"]
        tab.locator("#play[aria-label=Play]").wait_for()
        assert step(tab) == episodes.STEPS
        assert tab.locator("#moment").inner_text() == f"{episodes.STEPS} / {episodes.STEPS}"
        assert tab.evaluate("location.hash") == f"#step={episodes.STEPS}"


def test_two_policies_stay_in_step_and_one_that_has_ended_stays_at_its_end(browser, tmp_path):
    short = episodes.recorded(episodes.random_action, steps=20)
    path = tmp_path / "two.html"
    path.write_text(episode_page({"long": episodes.of("path_gain"), "short": short}))
    with opened(browser, path) as tab:
        for at in (7, 20, 45):
            tab.locator("#scrub").fill(str(at))
            shown = tab.locator(".covered").all_inner_texts()
            recordings = (episodes.of("path_gain"), short)
            expected = [each.coverage[min(at, each.steps)] for each in recordings]
            assert shown == [f"{100 * share:.1f} %" for share in expected]


def test_the_keyboard_plays(browser, pages):
    with opened(browser, pages("random")) as tab:
        for key, expected in (
            *(("ArrowRight", 1), ("ArrowRight", 2), ("ArrowLeft", 1), ("Shift+ArrowRight", 11)),
            *(("End", episodes.STEPS), ("Home", 0)),
        ):
            tab.keyboard.press(key)
            assert step(tab) == expected, key
        (event, *_) = tab.evaluate("player.then(({ episodes }) => episodes[0].events)")
        tab.keyboard.press("n")
        assert step(tab) == event
        assert tab.locator(".why b").inner_text().startswith("The filter steps in")
        views = []
        for _ in range(3):
            tab.keyboard.press("v")
            views.append(state(tab)["view"])
        assert sorted(views) == ["both", "forest", "map"]
        tab.keyboard.press(" ")
        assert state(tab)["playing"]
        tab.keyboard.press(" ")
        assert not state(tab)["playing"]


def test_a_link_leads_to_its_moment(browser, pages):
    with opened(browser, pages("random"), "#step=23") as tab:
        assert step(tab) == 23 and not state(tab)["playing"]
        tab.evaluate("location.hash = '#step=9'")
        tab.get_by_text(f"9 / {episodes.STEPS}", exact=True).wait_for()
        tab.evaluate("location.hash = '#step=99999'")
        tab.get_by_text(f"{episodes.STEPS} / {episodes.STEPS}", exact=True).wait_for()


@pytest.mark.parametrize("motion", ["reduce", "no-preference"])
def test_the_page_plays_by_itself_unless_the_reader_wants_less_motion(browser, pages, motion):
    with opened(browser, pages("random"), "", reduced_motion=motion) as tab:
        assert state(tab)["playing"] == (motion == "no-preference")
        tab.keyboard.press("End")


def test_the_curve_is_scrubbed_with_the_pointer(browser, pages):
    with opened(browser, pages("random")) as tab:
        box = tab.locator("#curves").bounding_box()
        tab.mouse.click(box["x"] + box["width"] - 14, box["y"] + 40)
        assert step(tab) == episodes.STEPS
        tab.mouse.click(box["x"] + 52, box["y"] + 40)
        assert step(tab) == 0


def test_the_compass_has_the_probabilities_and_what_is_not_feasible(browser, pages):
    moment = episodes.of("network").moments[30]
    with opened(browser, pages("network"), "#step=30") as tab:
        squares = tab.locator(".compass div")
        for place, action in enumerate((1, 2, 3, 4, 0, 5, 6, 7, 8)):
            square = squares.nth(place)
            share = 100 * moment.probability[action]
            text = square.inner_text()
            assert text == "<1" if 0.05 <= share < 0.95 else abs(int(text) - share) <= 0.55
            names = square.get_attribute("class").split()
            assert ("barred" in names) == (not moment.feasible[action])
            assert ("taken" in names) == (action == moment.executed)


@pytest.mark.parametrize("width", [320, 390, 800, 1600])
def test_nothing_runs_out_of_the_page(browser, pages, width):
    for names in (("path_gain",), ("path_gain", "network", "random")):
        size = {"width": width, "height": 800}
        with opened(browser, pages(*names), viewport=size) as tab:
            assert tab.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_can_be_read_by_everyone(browser, pages, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="NO BROWSER TEST")
    for names in (("path_gain",), ("network", "random")):
        with opened(browser, pages(*names), "#step=30", color_scheme=scheme) as tab:
            tab.locator("summary").click()
            found = axe.Axe().run(tab)
            assert found.violations_count == 0, found.generate_report()


def test_the_page_plays_inside_a_frame_as_in_a_notebook_or_a_dashboard(browser, tmp_path):
    page = episode_page({"random": episodes.of("random")})
    path = tmp_path / "notebook.html"
    path.write_text(f"<!doctype html><title>n</title><body data-ready=1>{page._repr_html_()}")
    with opened(browser, path, "") as tab:
        frame = tab.frame_locator("iframe")
        frame.locator("#last").click()
        assert frame.locator("#moment").inner_text() == f"{episodes.STEPS} / {episodes.STEPS}"
