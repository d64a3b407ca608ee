"""`gainful study`: a published experiment repeated, from its name to a folder of results."""

import json
import re

import numpy as np
import pandas as pd
import pytest

import gainful as gf
from gainful.jobs.study import FILES
from gainful.studies import STUDIES, Entry

from .conftest import command


@pytest.fixture(scope="module")
def registered():
    """The example study beside whatever else there is."""
    STUDIES["random-walk"] = Entry("Filters along a random walk (Walker, 1905)", "studies.walk:study")
    yield
    del STUDIES["random-walk"]


@pytest.fixture
def study(project, registered, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    return project


@pytest.fixture(scope="module")
def ran(registered, tmp_path_factory):
    """The study, run once for the tests that look at what it leaves."""
    from gainful.jobs import run_study

    folder = tmp_path_factory.mktemp("study") / "walk"
    told = []
    job = run_study("random-walk", folder, progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (24, 24)
    return job


def test_a_study_prints_tables_claims_and_verdicts_and_leaves_its_files(study):
    done = study.run("study", "random-walk", "--runs", 12, "--seed", 3)
    assert done.code == 0, done.err
    assert done.err == ""
    assert sorted(path.name for path in (study.folder / "out" / "random-walk").iterdir()) == sorted(FILES)
    for words in (
        "Filters along a random walk",
        "A. Walker, B. Drunk (1905)",
        "tuned (fair baseline)",
        "✓ reproduced",
        "✕ not reproduced",
        "◐ partly",
        "3 claims: 1 reproduced, 1 partly, 1 not reproduced; 12 runs, seed 3",
        "wrote out/random-walk/report.html, results.json, results.parquet, figures.parquet",
    ):
        assert words in done.out


def test_without_a_name_and_with_list_the_studies_are_shown(study):
    for arguments in ((), ("--list",), ("random-walk", "--list")):
        done = study.run("study", *arguments)
        assert done.code == 0
        assert re.search(r"random-walk.*Filters along a random walk \(Walker, 1905\)", done.out)
        assert done.out.rstrip().splitlines()[-1].startswith("run one:  gainful study ")
        assert study.left == []


def test_no_studies_is_said_in_words(study, monkeypatch):
    monkeypatch.setattr("gainful.cli.app.STUDIES", {})
    assert study.run("study").out == "no studies yet\n"


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["random-wlak"], "error: 'random-wlak' is not a study; did you mean 'random-walk'?"),
        (["random-walk", "--runs", "0"], "error: runs: expected a whole number of at least 1, got 0"),
        (["random-walk", "--seed", "-1"], "error: seed: expected a whole number of at least 0, got -1"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(study, arguments, line):
    done = study.run("study", *arguments)
    assert (done.code, done.err) == (2, line + "\n")
    assert study.left == []


def test_a_folder_that_cannot_be_written_is_found_before_the_runs(study, monkeypatch):
    monkeypatch.setattr("gainful.studies.base.run_experiment", None)
    done = study.run("study", "random-walk", "--out", "drive.csv")
    assert done.code == 1
    assert "output folder drive.csv: a file of that name is in the way" in done.err


def test_results_are_valid_json_with_every_claim_check_and_table(ran):
    def refuse(word):
        raise AssertionError(word)

    data = json.loads((ran.folder / "results.json").read_text(), parse_constant=refuse)
    assert data["verdicts"] == {"reproduced": 1, "partly": 1, "not reproduced": 1}
    assert [claim["verdict"] for claim in data["claims"]] == ["reproduced", "not reproduced", "partly"]
    check = data["claims"][1]["checks"][0]
    assert check["expected"] == {"low": "-infinity", "high": 1.0}
    assert check["passed"] is False
    assert check["found"]["low"] < check["found"]["value"] < check["found"]["high"]
    quiet = data["experiments"]["quiet"]
    assert (quiet["runs"], quiet["baseline"]) == (12, "tuned")
    found = ran.outcome.mean("quiet", "tuned", "square")
    assert quiet["contenders"]["tuned"]["square"] == {
        "value": found.value,
        "low": found.low,
        "high": found.high,
        "unit": "m^2",
        "runs": 12,
    }
    assert data["experiments"]["jump"]["contenders"]["sluggish"]["delay"]["value"] == "infinity"
    assert data["tables"][0]["rows"][1][0] == "tuned (fair baseline)"


def test_every_number_of_every_run_is_in_the_table(ran):
    table = pd.read_parquet(ran.folder / "results.parquet")
    assert len(table) == 2 * 3 * 3 * 12
    mean = table.query("experiment == 'jump' and contender == 'nervous' and quantity == 'square'")["value"].mean()
    assert mean == pytest.approx(ran.outcome.mean("jump", "nervous", "square").value, rel=1e-12)
    assert table.attrs == {"study": "random-walk", "seed": 3, "gainful_version": gf.__version__}


def test_every_point_drawn_is_in_the_table_of_figures(ran):
    table = pd.read_parquet(ran.folder / "figures.parquet")
    assert table.groupby(["figure", "kind"]).size().to_dict() == {
        (0, "line"): 4 * 120,
        (1, "band"): 3 * 120,
        (1, "line"): 3 * 120,
        (2, "bar"): 3,
    }
    drawn = table.query("figure == 1 and kind == 'line' and name == 'tuned'")
    np.testing.assert_array_equal(drawn["y"], ran.outcome.trace("jump", "tuned", "square").mean)


def test_the_report_holds_claims_tables_and_sources(ran):
    text = (ran.folder / "report.html").read_text(encoding="utf-8")
    for words in (
        "<title>Filters along a random walk</title>",
        "Riccati variance",
        "It believes in a state that stands still.",
        "tuned (fair baseline)",
        "12 runs, seed 3",
        "Walker, B. Drunk (1905)",
        "The publication gives no noise levels",
    ):
        assert words in text
    assert "Never to be seen" not in text


def test_the_command_stands_on_its_own():
    done = command("study", "--list")
    assert done.returncode == 0, done.stderr
