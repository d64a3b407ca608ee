"""Verdicts follow from numbers, and their reasons say which."""

import itertools
import math

import pytest

from gainful.studies import Check, Claim, Measured, above, below, between, exactly, near
from gainful.studies.claims import verdict_of


@pytest.mark.parametrize(
    ("low", "high", "passed"),
    [(1.2, 1.8, True), (1.0, 2.0, True), (2.1, 3.0, False), (0.1, 0.9, False), (1.5, 2.5, None), (0.5, 2.5, None)],
)
def test_a_check_asks_for_the_whole_interval(low, high, passed):
    assert between(1.0, 2.0).judge(Measured((low + high) / 2, low, high, 20)) is passed


def test_tolerances_are_what_they_are_called():
    assert near(-5.0, relative=0.1) == between(-5.5, -4.5)
    assert near(5.0, absolute=1.0) == between(4.0, 6.0)
    assert below(1.0).judge(exactly(1.0)) is True
    assert above(1.0).judge(exactly(math.inf)) is True
    assert below(1.0).judge(exactly(math.inf)) is False
    assert [str(each) for each in (near(5.0, relative=0.1), below(0.5), above(2e7))] == [
        "4.5 to 5.5",
        "below 0.5",
        "above 2e+07",
    ]


def test_what_is_no_number_bears_nothing_out():
    assert below(1.0).judge(Measured(math.nan, -math.inf, math.inf, 20)) is False


def test_no_interval_tells_nothing():
    assert below(1.0).judge(Measured(0.5, -math.inf, math.inf, 1)) is None


@pytest.mark.parametrize("passed", itertools.product([True, False, None], repeat=3))
def test_a_verdict_is_one_that_more_runs_could_not_contradict(passed):
    # Every way in which the undecided checks could end.
    ends = [(True, False) if each is None else (each,) for each in passed]
    possible = {
        "reproduced" if all(end) else "partly" if any(end) else "not reproduced" for end in itertools.product(*ends)
    }
    verdict = verdict_of(list(passed))
    assert {verdict} == possible if verdict != "undecided" else len(possible) > 1


def claim(*found, why=None):
    checks = tuple(Check(f"number {k}", lambda outcome, one=one: one, below(1.0)) for k, one in enumerate(found))
    return Claim("small", "All numbers are small.", "below 1", checks, why or {})


def test_the_reason_of_a_mixed_verdict_starts_with_what_stands_in_the_way():
    finding = claim(Measured(0.5, 0.4, 0.6, 20), Measured(3.0, 2.5, 3.5, 20)).judge(None)
    assert finding.verdict == "partly"
    assert finding.reason == (
        "number 1: 3.00 ± 0.50, expected below 1: no; number 0: 0.50 ± 0.10, expected below 1: yes"
    )


def test_only_the_explanation_of_the_verdict_found_is_told():
    why = {"reproduced": "As it should be.", "not reproduced": "They are large."}
    assert claim(exactly(2.0), why=why).judge(None).reason.endswith("no. They are large.")
    assert claim(exactly(0.5), why=why).judge(None).why == "As it should be."
    assert claim(exactly(0.5), exactly(2.0), why=why).judge(None).why == ""


def test_a_note_on_a_number_is_part_of_the_reason():
    finding = claim(Measured(math.nan, -math.inf, math.inf, 3, note="not finite in 1 of 3 runs")).judge(None)
    assert finding.verdict == "not reproduced"
    assert "(not finite in 1 of 3 runs), expected below 1: no" in finding.reason
