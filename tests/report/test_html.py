"""The page: complete in itself, readable by people and programs, and never half-written."""

from __future__ import annotations

import dataclasses
import importlib
import json
import os
import re
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

import gainful.report
from gainful.errors import ConfigError, MissingExtraError
from gainful.report import Table, figures_of, write_report
from gainful.report.page import cell

FACTS = [("Filter", "extended Kalman filter"), ("Time", "compile 1.0 s, run 0.1 s")]


class Page(HTMLParser):
    """Elements of a page with their attributes and text."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, list[str]] = {}
        self._open: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self.texts.setdefault(tag, []).append("")
        if tag not in ("meta", "link", "br", "img"):
            self._open.append(tag)

    def handle_endtag(self, tag):
        if tag in self._open:
            while self._open.pop() != tag:
                pass

    def handle_data(self, data):
        for tag in set(self._open):
            self.texts[tag][-1] += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def path(vehicle, tmp_path_factory) -> Path:
    table = Table("Errors by state", ("State", "RMSE", "Coverage"), (("x [m]", 0.123456, "94 %"), ("y [m]", None, 1.0)))
    folder = tmp_path_factory.mktemp("report") / "deeper"
    return write_report(
        vehicle, folder / "run.html", title="Run 3", facts=FACTS, verdict="consistent: all well", tables=[table]
    )


@pytest.fixture(scope="module")
def page(path) -> Page:
    return Page(path)


def test_nothing_is_loaded_from_elsewhere(page, path):
    links = [
        value
        for _, attributes in page.elements
        for name, value in attributes.items()
        if name in ("src", "href", "srcset", "data", "action", "poster")
    ]
    assert links
    assert all(link == "data:," or link.startswith("#") for link in links)
    style = page.texts["style"][0]
    assert "url(" not in style
    assert "@import" not in style


def test_plotly_is_embedded_once(page):
    assert sum(len(text) > 1_000_000 for text in page.texts["script"]) == 1


def test_every_figure_is_there_with_its_words(page, vehicle_sections):
    sections = vehicle_sections
    figures = [text for text in page.texts["script"] if text.startswith("{")]
    assert len(figures) == len(sections) == len(page.all("figure"))
    for text, section, caption in zip(figures, sections, page.texts["figcaption"], strict=True):
        assert len(json.loads(text)["data"]) == len(section.figure.data)
        assert caption.replace("\N{NO-BREAK SPACE}", " ") == section.caption
    assert page.texts["h2"] == ["States", "Trajectory", "Errors", "Innovations", "Consistency", "Whiteness"]


def test_the_page_can_be_read_by_a_screen_reader(page):
    assert page.all("html")[0]["lang"] == "en"
    assert page.texts["title"] == page.texts["h1"] == ["Run 3"]
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    plots = [attributes for attributes in page.all("div") if attributes.get("class") == "plot"]
    assert all(plot["aria-describedby"] in ids and plot["aria-label"] for plot in plots)
    assert all(head["scope"] in ("col", "row") for head in page.all("th"))
    assert len(page.all("caption")) == len(page.all("table")) == 2
    anchors = [link["href"].removeprefix("#") for link in page.all("a")]
    assert set(anchors) <= set(ids)


def test_header_tells_counts_facts_and_verdict(page):
    text = page.texts["header"][0].replace("\N{NO-BREAK SPACE}", " ")
    assert "600 rows over 119.8 s" in text
    assert " missing, " in text
    assert re.search(r"\d+ rejected", text)
    assert all(name in text and value in text for name, value in FACTS)
    assert "Consistent" in text
    assert "All well" in text


def test_warnings_are_shown(walk, tmp_path):
    result = dataclasses.replace(walk(50), warnings=("Q is per step & the steps vary",))
    page = Page(write_report(result, tmp_path / "a.html", title="a", facts=[], verdict="?"))
    assert "Q is per step & the steps vary" in page.texts["li"]


@pytest.mark.parametrize(
    ("verdict", "given", "kind", "word"),
    [
        ("consistent: NIS 1.0", None, "good", "Consistent"),
        ("not consistent: NIS 4.0", None, "bad", "Not consistent"),
        ("undecided: two rows", None, "unknown", "Undecided"),
        ("nothing to say", None, "unknown", "Undecided"),
        ("NIS 1.0", "good", "good", "Consistent"),
    ],
)
def test_verdict_is_told_in_a_word_and_a_colour(walk, tmp_path, verdict, given, kind, word):
    page = Page(write_report(walk(50), tmp_path / "a.html", title="a", facts=[], verdict=verdict, judgement=given))
    assert any(attributes.get("class") == f"verdict {kind}" for attributes in page.all("p"))
    assert any(text.strip().endswith(word) for text in page.texts["span"])


def test_unknown_judgement_is_refused(walk, tmp_path):
    with pytest.raises(ConfigError, match="judgement: expected one of 'good', 'bad', 'unknown', got 'fine'"):
        write_report(walk(50), tmp_path / "a.html", title="a", facts=[], verdict="?", judgement="fine")


def test_markup_in_words_is_not_markup(walk, tmp_path):
    evil = "</title></script><script>alert(1)</script>"
    result = walk(50, names=("x</script><b>", "a & b"))
    table = Table(evil, (evil,), ((evil,),))
    path = write_report(result, tmp_path / "a.html", title=evil, facts=[(evil, evil)], verdict=evil, tables=[table])
    page = Page(path)
    assert "<script>alert" not in path.read_text(encoding="utf-8")
    assert page.texts["h1"] == [evil]
    assert len(page.texts["script"]) == len(figures_of(result)) + 2
    labels = json.loads(page.texts["script"][0])["layout"]["annotations"]
    assert labels[0]["text"].startswith("<b>x&lt;/script&gt;&lt;b&gt;</b>")


@pytest.mark.parametrize("step", ["write", "replace"])
def test_a_failing_write_leaves_the_old_file(walk, tmp_path, monkeypatch, step):
    path = tmp_path / "run.html"
    path.write_text("old")

    def half(self, text, **_):
        with open(self, "w", encoding="utf-8") as file:
            file.write(text[:100])
        raise OSError("disk full")

    def refuse(*_):
        raise OSError("disk full")

    with monkeypatch.context() as patch:
        patch.setattr(*((Path, "write_text", half) if step == "write" else (os, "replace", refuse)))
        with pytest.raises(OSError, match="disk full"):
            write_report(walk(50), path, title="a", facts=[], verdict="?")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_written_file_has_ordinary_permissions(path):
    other = path.with_name("other")
    other.touch()
    assert path.stat().st_mode == other.stat().st_mode
    other.unlink()


def test_a_long_record_makes_a_small_file(walk, tmp_path):
    result = walk(100_000)
    path = write_report(result, tmp_path / "long.html", title="long", facts=[], verdict="?")
    assert path.stat().st_size < 8e6
    assert "Thinned from 100,000 rows" in path.read_text(encoding="utf-8")


def test_smoothed_results_report_both_estimates(smoothed, tmp_path):
    text = write_report(smoothed, tmp_path / "a.html", title="a", facts=[], verdict="?").read_text()
    assert '"name":"smoothed estimate"' in text
    assert '"name":"filtered"' in text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.123456, "0.1235"),
        (123456, "123,456"),
        (54321.6, "54,322"),
        (1.5e-7, "1.5e-07"),
        (float("nan"), "\N{EN DASH}"),
        ("a", "a"),
    ],
)
def test_cells_are_short(value, text):
    assert cell(value) == text


@pytest.mark.parametrize("name", ["plotly", "jinja2"])
def test_a_missing_package_is_named_with_its_cure(monkeypatch, name):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingExtraError, match=r"pip install 'gainful\[report\]'"):
        importlib.reload(gainful.report)


def test_shares_are_told_in_per_cent_where_the_heading_says_so():
    assert cell(0.9025, "inside 95 % band") == "90.2\N{NO-BREAK SPACE}%"
    assert cell(0.9025, "share") == "0.9025"
    assert cell(None, "inside 95 % band") == "\N{EN DASH}"
