"""The example study from end to end: its numbers by name, its tables and its findings."""

import numpy as np
import pytest

from gainful.errors import ConfigError
from gainful.studies import STUDIES, Entry, Measured, exactly, find_study, mean_interval, rms_interval

from . import walk


@pytest.fixture(scope="module")
def outcome():
    return walk.study().run()


def test_claims_that_hold_fail_and_hold_in_part_are_told_apart(outcome):
    assert [finding.verdict for finding in outcome.findings] == ["reproduced", "not reproduced", "partly"]
    assert outcome.counts == {"reproduced": 1, "partly": 1, "not reproduced": 1}
    assert outcome.findings[1].why == "It believes in a state that stands still."


def test_too_few_runs_decide_nothing():
    # Two runs leave a factor of 12.7 of the deviation, and no interval of a median.
    assert set(walk.study().run(1).counts) == {"undecided"}


def test_the_same_seed_gives_the_same_findings(outcome):
    again = walk.study().run(at_once=3)
    assert [finding.reason for finding in again.findings] == [finding.reason for finding in outcome.findings]


def test_numbers_are_asked_for_by_name(outcome):
    values = outcome.values("quiet", "tuned", "square")
    assert values.shape == (12,)
    assert outcome.mean("quiet", "tuned", "square") == mean_interval(values, unit="m^2")
    assert outcome.summary("jump", "nervous", "delay") == outcome.median("jump", "nervous", "delay")
    assert outcome.summary("jump", "nervous", "caught") == outcome.share("jump", "nervous", "caught")
    assert outcome.rms("quiet", "tuned", "square") == rms_interval(values, unit="m^2")
    both = outcome.mean("quiet", "nervous", "square").value - outcome.mean("quiet", "tuned", "square").value
    assert outcome.difference("quiet", "square", "nervous", minus="tuned").value == pytest.approx(both)
    assert outcome.trace("quiet", "tuned", "square").mean.shape == (walk.ROWS,)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (
            ("quite", "tuned", "square"),
            "experiment of study 'random-walk': 'quite' is not known; did you mean 'quiet'?",
        ),
        (("quiet", "tined", "square"), "contender of experiment 'quiet': 'tined' is not known; did you mean 'tuned'?"),
        (("quiet", "tuned", "sqare"), "quantity of experiment 'quiet': 'sqare' is not known; did you mean 'square'?"),
    ],
)
def test_a_wrong_name_is_answered_with_the_right_one(outcome, ask, message):
    with pytest.raises(ConfigError) as caught:
        outcome.values(*ask)
    assert str(caught.value) == message


def test_tables_have_every_contender_with_the_baseline_marked(outcome):
    table = outcome.table("jump")
    assert table.title == "With a jump of 8 m"
    assert table.columns == ("Contender", "Mean square error [m^2]", "Delay [s]", "Caught in 10 s")
    assert [row[0] for row in table.rows] == ["sluggish", "tuned (fair baseline)", "nervous"]
    assert table.rows[1][1] == outcome.mean("jump", "tuned", "square")
    assert outcome.study.tables_of(outcome)[1] == table
    assert outcome.table("jump", ["delay"], title="Delays").columns == ("Contender", "Delay [s]")


def test_a_quantity_is_compared_over_experiments(outcome):
    table = outcome.compared("Errors", "square")
    assert table.columns == ("Contender", "Without a jump [m^2]", "With a jump of 8 m [m^2]")
    assert table.rows[2][1:] == tuple(outcome.mean(name, "nervous", "square") for name in ("quiet", "jump"))


def test_an_experiment_without_noise_has_exact_numbers():
    still = walk.experiment(random=False)
    outcome = walk.study(experiments=(still,)).run(20)
    value = float(outcome.values("quiet", "tuned", "square")[0])
    assert outcome.mean("quiet", "tuned", "square") == exactly(value, "m^2")
    assert outcome.share("quiet", "tuned", "caught") == exactly(1.0)
    assert outcome.median("quiet", "tuned", "delay").low == outcome.median("quiet", "tuned", "delay").high
    ratio = outcome.ratio("quiet", "square", "nervous", over="tuned")
    assert ratio == exactly(outcome.values("quiet", "nervous", "square")[0] / value)
    assert outcome.difference("quiet", "square", "nervous", minus="tuned").unit == "m^2"


def test_the_measured_numbers_of_a_record_are_plain_arrays(outcome):
    assert isinstance(outcome.record("jump").truth["x"], np.ndarray)
    assert isinstance(outcome.findings[0].checks[0].found, Measured)


def test_a_study_is_found_by_its_name_and_imported_only_then(monkeypatch):
    monkeypatch.setitem(STUDIES, "random-walk", Entry("A walk", f"{walk.__name__}:study"))
    monkeypatch.setitem(STUDIES, "broken", Entry("Nothing", "gainful.no_such_module:study"))
    assert find_study("random-walk").title == "Filters along a random walk"


def test_every_registered_study_has_a_name_it_is_registered_by_and_one_line():
    for name, entry in STUDIES.items():
        assert name == name.lower().replace("_", "-")
        assert "\n" not in entry.summary
