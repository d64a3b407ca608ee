"""A study's page: names look alike throughout, nothing is loaded from elsewhere, and it fits a phone."""

import math
import re

import numpy as np
import pytest
from studies import walk
from test_browser import ARGUMENTS, BROWSER, Visit

from gainful.report import write_study_report
from gainful.report.page import cell
from gainful.report.panels import BLACK
from gainful.report.study import LOOKS
from gainful.report.study_figures import study_sections
from gainful.studies import Band, Chart, Figure, Line, Measured, Panel, exactly
from gainful.studies.claims import VERDICTS

T = np.linspace(0.0, 10.0, 101)


def lines(*names, **given):
    return tuple(Line(name, T, T + k, **given) for k, name in enumerate(names))


def figure(*panels, **given):
    return Figure("Title", "Caption.", panels or (Panel("x", lines("a", "b"), "m"),), **given)


def chart(log=False, **bars):
    return Chart("Chart", "Caption.", "RMSE", bars, "m", log)


def traces(section, name):
    return [trace for trace in section.figure.data if trace.name == name]


@pytest.fixture(scope="module")
def outcome():
    return walk.study().run()


@pytest.fixture(scope="module")
def path(outcome, tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    tables, figures = outcome.study.tables_of(outcome), outcome.study.figures_of(outcome)
    many = Panel("many", lines(*(f"a filter with a long name, number {k}" for k in range(9))))
    figures.append(Figure("Many", "Nine lines.", (many,) * 6, x_label="scale"))
    return write_study_report(outcome, folder / "deep" / "report.html", tables=tables, figures=figures)


def test_a_name_looks_the_same_in_all_figures_and_unlike_every_other():
    names = [f"filter {k}" for k in range(35)]
    sections = study_sections([figure(Panel("x", lines(*names))), figure(Panel("y", lines(*names[::-1])))])
    looks = [{trace.name: (trace.line.color, trace.line.dash) for trace in section.figure.data} for section in sections]
    assert looks[0] == looks[1]
    assert len(set(looks[0].values())) == len(names)


def test_what_others_are_compared_with_is_black_and_takes_no_colour_from_them():
    truth = lines("truth", "threshold", reference=True)
    (section,) = study_sections([figure(Panel("x", (*truth, *lines("a"))))])
    (plain,) = study_sections([figure(Panel("x", lines("a")))])
    assert {trace.line.color for name in ("truth", "threshold") for trace in traces(section, name)} == {BLACK}
    assert traces(section, "truth")[0].line.dash != traces(section, "threshold")[0].line.dash
    assert traces(section, "a")[0].line == traces(plain, "a")[0].line


def test_long_lines_keep_their_extremes_and_short_ones_every_point():
    t = np.arange(40_000.0)
    spike = np.where(t == 12_345, 7.0, 0.0)
    (section,) = study_sections([figure(Panel("x", (Line("a", t, spike), Line("b", T, T))))])
    assert traces(section, "a")[0].y.max() == 7.0
    assert len(traces(section, "a")[0].y) < 3000
    np.testing.assert_allclose(traces(section, "b")[0].y, T, rtol=1e-6)


def test_gaps_and_what_a_logarithm_has_no_place_for_are_left_out():
    y = np.where(T < 2, -1.0, np.where(T > 8, np.nan, T))
    band = Band("a", T, y, 2 * y, "95 % interval")
    given = figure(Panel("x", (Line("a", T, y), band), log=True), Panel("y", (Line("b", T, y),)))
    (section,) = study_sections([given])
    drawn = traces(section, "a")[0].y
    np.testing.assert_array_equal(np.isnan(drawn), (T < 2) | (T > 8))
    assert np.nanmin(traces(section, "b")[0].y) == -1.0
    assert section.figure.layout.yaxis.type == "log"
    assert section.figure.layout.yaxis2.type != "log"
    assert np.nanmin(traces(section, "a, 95 % interval")[0].y) >= 2


def test_a_band_of_nothing_is_not_drawn():
    nothing = np.full_like(T, np.nan)
    (section,) = study_sections([figure(Panel("x", (Band("a", T, nothing, nothing, "spread"), *lines("a"))))])
    assert [trace.name for trace in section.figure.data] == ["a"]


def test_many_panels_are_shared_out_over_figures():
    first, second = study_sections([figure(*[Panel(f"x{k}", lines("a")) for k in range(7)])])
    assert (first.caption, second.caption) == ("Caption.", "Continued.")


def test_only_figures_over_time_are_zoomed_together():
    given = [figure(), figure(x_label="scale of Q", x_log=True), chart(a=exactly(1.0))]
    over_time, over_scale, bars = study_sections(given)
    assert [section.timed for section in (over_time, over_scale, bars)] == [True, False, False]
    assert over_time.figure.layout.xaxis.title.text == "time [s]"
    assert over_scale.figure.layout.xaxis.title.text == "scale of Q"
    assert over_scale.figure.layout.xaxis.type == "log"


@pytest.mark.parametrize("log", [False, True])
def test_bars_have_their_intervals_and_what_is_no_number_is_said_in_words(log):
    bars = {
        "good": Measured(2.0, 1.5, 3.0, 20),
        "single": Measured(1.0, -math.inf, math.inf, 1),
        "late": Measured(math.inf, 3.0, math.inf, 20),
        "broken": Measured(math.nan, -math.inf, math.inf, 20),
    }
    (section,) = study_sections([chart(log, **bars)])
    (trace,) = section.figure.data
    assert list(trace.y) == ["good", "single"]
    assert list(trace.error_x.array) == [1.0, 0.0]
    assert list(trace.error_x.arrayminus) == [0.5, 0.0]
    assert [(note.y, note.text) for note in section.figure.layout.annotations] == [
        ("late", "never"),
        ("broken", "\N{EN DASH}"),
    ]
    assert list(section.figure.layout.yaxis.categoryarray) == ["broken", "late", "single", "good"]


def test_a_measured_cell_is_never_broken_in_two():
    assert cell(Measured(0.5, 0.4, 0.6, 9, "m")) == "0.50\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}0.10"


def test_every_verdict_has_a_mark_of_its_own():
    assert set(LOOKS) == set(VERDICTS)
    assert len({look.mark for look in LOOKS.values()}) == len({look.judgement for look in LOOKS.values()}) == 4


def test_words_of_a_study_are_shown_as_they_are(tmp_path):
    study = walk.study(title="1 < 2 & <script>alert(1)</script>", notes=(), figures=None)
    outcome = study.run(1)
    path = write_study_report(outcome, tmp_path / "report.html", tables=[], figures=[])
    text = path.read_text(encoding="utf-8")
    assert "<script>alert(1)" not in text
    assert "1 &lt; 2 &amp; &lt;script&gt;" in text
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]


def test_the_page_needs_nothing_else(path):
    text = path.read_text(encoding="utf-8")
    before_scripts = text[: text.index("<script>")]
    assert re.findall(r'(?:src|href)="(?!#|data:,)([^"]*)"', before_scripts) == []


@pytest.mark.skipif(BROWSER is None, reason="no chromium or chrome on this machine")
def test_the_page_is_drawn_without_a_complaint_and_fits_a_phone(path):
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    phone = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=ARGUMENTS)
        for options in ({"viewport": {"width": 1280, "height": 900}}, phone):
            with Visit(browser, path, **options) as visit:
                drawn = visit.page.evaluate("document.querySelectorAll('.plot svg.main-svg').length > 4")
                assert drawn
                assert visit.complaints == []
                assert visit.requests == [path.as_uri()]
                width = visit.page.evaluate("document.documentElement.scrollWidth")
                assert width <= options["viewport"]["width"]
                claims = visit.page.evaluate("[...document.querySelectorAll('.claim .badge')].map((e) => e.innerText)")
                assert claims == ["✓ reproduced", "✕ not reproduced", "◐ partly"]
        browser.close()
