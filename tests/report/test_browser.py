"""The page in a real browser, without a network."""

from __future__ import annotations

import shutil

import pytest

from gainful.diagnostics import verdict
from gainful.report import Table, figures_of, write_report

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]

pytestmark = pytest.mark.skipif(BROWSER is None, reason="no chromium or chrome on this machine")


@pytest.fixture(scope="module")
def browser():
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def paths(vehicle, attitude, smoothed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("browser")
    wide = Table(
        "Errors", ("State", "RMSE", "Coverage", "Mean sigma"), (("heading_of_the_vehicle [rad]", 0.1, 0.9, 1.0),)
    )
    facts = [("Data", "a_rather_long_file_name_without_a_single_blank_in_it_2024_05_17_run_0003.csv")]
    out = {}
    for name, result in {"vehicle": vehicle, "attitude": attitude, "smoothed": smoothed}.items():
        path = folder / f"{name}.html"
        write_report(result, path, title=f"The {name}", facts=facts, verdict=str(verdict(result)), tables=[wide])
        out[name] = (path, len(figures_of(result)))
    return out


class Visit:
    """A page that is open, and all it has complained about or asked for."""

    def __init__(self, browser, path, **options) -> None:
        self.page = browser.new_context(**options).new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(f"{message.type}: {message.text}"))
        self.page.on("pageerror", lambda problem: self.complaints.append(str(problem)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("html[data-drawn]", state="attached", timeout=60_000)

    def __enter__(self) -> Visit:
        return self

    def __exit__(self, *_) -> None:
        self.page.context.close()


@pytest.mark.parametrize("name", ["vehicle", "attitude", "smoothed"])
def test_all_figures_are_drawn_without_a_complaint_or_a_request(browser, paths, name):
    path, figures = paths[name]
    with Visit(browser, path, viewport={"width": 1280, "height": 900}) as visit:
        drawn = "[...document.querySelectorAll('.js-plotly-plot')].filter((plot) => plot.querySelector('svg.main-svg'))"
        assert visit.page.evaluate(f"{drawn}.length") == figures
        assert visit.page.evaluate(f"{drawn}.every((plot) => plot.querySelector('path.js-line, .point'))")
        assert visit.complaints == []
        assert visit.requests == [path.as_uri()]


@pytest.mark.parametrize("name", ["vehicle", "attitude"])
def test_a_phone_needs_no_sideways_scrolling(browser, paths, name):
    phone = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
    with Visit(browser, paths[name][0], **phone) as visit:
        assert visit.page.evaluate("document.documentElement.scrollWidth") <= 390
        widths = visit.page.evaluate("[...document.querySelectorAll('.main-svg')].map((svg) => svg.clientWidth)")
        assert max(widths) <= 390
        # A finger on a figure scrolls the page.
        assert visit.page.evaluate("document.querySelector('.plot').layout.dragmode") is False


def test_zooming_one_figure_zooms_all_over_time(browser, paths):
    ranges = (
        "[...document.querySelectorAll('.plot[data-timed]')].flatMap((plot) => Object.keys(plot.layout)"
        ".filter((key) => /^xaxis/.test(key)).map((key) => plot.layout[key].range.map(Math.round)))"
    )
    with Visit(browser, paths["vehicle"][0], viewport={"width": 1280, "height": 900}) as visit:
        plot = visit.page.locator(".plot").nth(3)
        plot.scroll_into_view_if_needed()
        box = plot.bounding_box()
        before = visit.page.evaluate(ranges)
        visit.page.mouse.move(box["x"] + 300, box["y"] + 80)
        visit.page.mouse.down()
        visit.page.mouse.move(box["x"] + 600, box["y"] + 84, steps=5)
        visit.page.mouse.up()
        visit.page.wait_for_timeout(800)
        after = visit.page.evaluate(ranges)
        assert len(after) > 8
        assert all(one == after[0] for one in after)
        assert after[0] != before[0]
        assert visit.complaints == []


def test_hovering_tells_time_and_value(browser, paths):
    with Visit(browser, paths["vehicle"][0], viewport={"width": 1280, "height": 900}) as visit:
        plot = visit.page.locator(".plot").first
        plot.scroll_into_view_if_needed()
        box = plot.bounding_box()
        visit.page.mouse.move(box["x"] + 500, box["y"] + 100)
        text = plot.locator(".hoverlayer").text_content(timeout=5000)
        visit.page.wait_for_timeout(500)
        text = plot.locator(".hoverlayer").text_content()
        assert "t = " in text
        assert "estimate" in text
        assert "truth" in text


def test_figures_are_drawn_to_the_width_of_paper_when_printed(browser, paths):
    with Visit(browser, paths["vehicle"][0], viewport={"width": 1280, "height": 900}) as visit:
        visit.page.evaluate(
            "window.addEventListener('beforeprint', () => setTimeout(() => (window.paper ="
            " [...document.querySelectorAll('.main-svg')].map((svg) => Number(svg.getAttribute('width'))))))"
        )
        visit.page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
        visit.page.wait_for_timeout(500)
        assert set(visit.page.evaluate("window.paper")) == {690}
        visit.page.evaluate("window.dispatchEvent(new Event('afterprint'))")
        visit.page.wait_for_timeout(500)
        assert visit.page.evaluate("document.querySelector('.main-svg').clientWidth") > 900
