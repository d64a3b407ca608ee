"""`gainful study all`: every study one after the other, and the gallery of what they came to."""

import html
import json
import re

import pytest
from studies import tiny

from gainful.jobs.study import FILES
from gainful.report import Card
from gainful.studies import STUDIES


@pytest.fixture
def gallery(project, monkeypatch):
    """The command among studies that take no time."""
    monkeypatch.setenv("COLUMNS", "120")

    def among(*names):
        STUDIES.clear()
        STUDIES.update(tiny.entries(*names))
        return project

    kept = dict(STUDIES)
    yield among
    STUDIES.clear()
    STUDIES.update(kept)


def verdicts(folder):
    return json.loads((folder / "verdicts.json").read_text(encoding="utf-8"))


def page(folder):
    return (folder / "index.html").read_text(encoding="utf-8")


def test_every_study_is_run_into_its_folder_and_shown_in_one_table(gallery):
    project = gallery("first", "second")
    done = project.run("study", "all", "--runs", 2, "--seed", 5)
    assert (done.code, done.err) == (0, "")
    out = project.folder / "out" / "all"
    assert sorted(path.name for path in out.iterdir()) == ["first-draw", "index.html", "second-draw", "verdicts.json"]
    for name in ("first-draw", "second-draw"):
        assert sorted(path.name for path in (out / name).iterdir()) == sorted(FILES)
    assert re.search(r"first-draw +│ +2 │ +1 │ +0 │ +1 │ +0 │ +2 │", done.out)
    assert "2 of 2 studies finished, 4 claims" in done.out
    assert "wrote out/all/index.html, verdicts.json, and a folder per finished study" in done.out

    data = verdicts(out)
    assert data["verdicts"] == {"reproduced": 2, "not reproduced": 2}
    assert [study["state"] for study in data["studies"]] == ["finished", "finished"]
    assert (data["studies"][0]["runs"], data["studies"][0]["seed"]) == (2, 5)
    own = json.loads((out / "first-draw" / "results.json").read_text(encoding="utf-8"))["claims"]
    for mine, its in zip(data["claims"], own, strict=False):
        assert mine["study"] == "first-draw"
        assert {key: mine[key] for key in ("statement", "published", "verdict", "reason")} == {
            key: its[key] for key in ("statement", "published", "verdict", "reason")
        }


def test_the_page_links_to_claims_that_are_there_and_to_nothing_outside_its_folder(gallery):
    project = gallery("first", "second")
    assert project.run("study", "all", "--runs", 2).code == 0
    out = project.folder / "out" / "all"
    text = page(out)
    links = re.findall(r'(?:src|href)="(?!data:,)([^"]*)"', text[: text.index("<script>")])
    outside = [link for link in links if not link.startswith("#")]
    assert len(outside) == 2 + 2 + 4  # in the overview, below the title, per claim
    for link in outside:
        file, _, anchor = link.partition("#")
        assert not anchor or f'id="{anchor}"' in (out / file).read_text(encoding="utf-8")
    for link in links:
        if link.startswith("#"):
            assert f'id="{link[1:]}"' in text, link


def test_figures_that_tell_are_shown_and_words_are_shown_as_they_are(gallery):
    project = gallery("first", "second")
    assert project.run("study", "all", "--runs", 2).code == 0
    text = page(project.folder / "out" / "all")
    assert "A curve" in text
    assert "Not to be shown" not in text
    for words in ("What <draws> come to.", "Rises <b>.", "1 < 2"):
        assert html.escape(words) in text
        assert words not in text.replace(html.escape(words), "")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("broken", "failed: no draw: expected a <hat>, got none"),
        ("wrong", "failed: KeyError: 'hat'"),
        ("stopped", "interrupted"),
    ],
)
def test_a_study_that_ends_early_is_told_and_what_was_finished_stays(gallery, name, why):
    project = gallery("first", name, "second")
    done = project.run("study", "all", "--runs", 2, "--out", "g")
    assert done.code == 1
    out = project.folder / "g"
    assert (out / "first-draw" / "report.html").exists()
    data = verdicts(out)
    rest = "not run" if name == "stopped" else "finished"
    assert [study["state"] for study in data["studies"]] == ["finished", why.partition(":")[0], rest]
    text = page(out)
    assert f"{name}-draw: {html.escape(why, quote=False)}" in text.replace("&#39;", "'")
    assert ("in wrong" in text) is (name == "wrong")  # where the error nobody expected came from
    assert f"{name}-draw" in done.out
    if name != "stopped":
        assert f"{name}-draw {why}" in done.out


def test_what_was_finished_with_the_same_settings_is_kept_on_request(gallery):
    project = gallery("first", "broken")
    assert project.run("study", "all", "--runs", 2, "--out", "g").code == 1
    report = project.folder / "g" / "first-draw" / "report.html"
    report.write_text("as it was", encoding="utf-8")
    assert project.run("study", "all", "--runs", 2, "--out", "g", "--resume").code == 1
    assert report.read_text(encoding="utf-8") == "as it was"
    for changed in (["--runs", 3], ["--runs", 2, "--seed", 1]):
        report.write_text("as it was", encoding="utf-8")
        assert project.run("study", "all", *changed, "--out", "g", "--resume").code == 1
        assert "</html>" in report.read_text(encoding="utf-8")


def test_a_card_that_is_none_is_made_again(gallery):
    project = gallery("first")
    card = project.folder / "g" / "first-draw" / "card.json"
    card.parent.mkdir(parents=True)
    for text in ("{", "[]", '{"claims": []}'):
        card.write_text(text, encoding="utf-8")
        assert project.run("study", "all", "--runs", 2, "--out", "g", "--resume").code == 0
        assert Card.read(card.read_text(encoding="utf-8")).runs == 2


@pytest.mark.parametrize(
    ("arguments", "code", "line"),
    [
        (["all", "--runs", "0"], 2, "error: runs: expected a whole number of at least 1, got 0"),
        (["all", "--seed", "-1"], 2, "error: seed: expected a whole number of at least 0, got -1"),
        (["first-darw"], 2, "error: 'first-darw' is not a study; did you mean 'first-draw'?"),
        (["first-draw", "--resume"], 2, "error: --resume: expected with 'all' only, got it with 'first-draw'"),
        (["all", "--out", "drive.csv"], 1, "error: output folder drive.csv: a file of that name is in the way"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(gallery, arguments, code, line):
    project = gallery("first")
    done = project.run("study", *arguments)
    assert done.code == code
    assert done.err.startswith(line)
    assert done.err.count("\n") == 1
    assert project.left == []


def test_the_library_runs_those_that_are_named(gallery, tmp_path):
    from gainful.errors import ConfigError
    from gainful.jobs import run_all_studies

    gallery("first", "second")
    titles, told = [], []
    job = run_all_studies(
        tmp_path / "g",
        names=["second-draw"],
        runs=2,
        started=lambda study: titles.append(study.title),
        progress=lambda done, total: told.append((done, total)),
    )
    assert titles == ["Draws of second-draw"]
    assert told[-1] == (2, 2)
    assert [card.study for card in job.cards] == ["second-draw"]
    assert job.missing == ()
    with pytest.raises(ConfigError, match="'other' is not a study; known: first-draw, second-draw"):
        run_all_studies(tmp_path / "g", names=["other"])
