"""The study of two-stage fault estimation on a small budget: its numbers, as far as a few flights tell them."""

import numpy as np
import pytest

from gainful.studies import Experiment, find_study
from gainful.studies.monte_carlo import run_experiment, run_key
from gainful.studies.two_stage_fault_estimation.contenders import GATED, GLR, PUBLISHED, TUNED, contenders
from gainful.studies.two_stage_fault_estimation.measures import Measure, Traces, quantities
from gainful.studies.two_stage_fault_estimation.scenarios import OFFSET, ONSET, SCENARIOS, flight_of

RUNS = 2


@pytest.fixture(scope="module")
def offset():
    chosen = {name: each for name, each in contenders(OFFSET).items() if name in (PUBLISHED, TUNED, GATED, GLR)}
    experiment = Experiment(
        OFFSET.name,
        OFFSET.title,
        flight_of(OFFSET),
        chosen,
        Measure(OFFSET.scale),
        quantities(OFFSET),
        Traces(OFFSET.scale),
        baseline=TUNED,
    )
    return run_experiment(experiment, RUNS, 12)


def of(results, contender, quantity):
    return float(results.values[contender][quantity].mean())


@pytest.mark.parametrize(
    ("contender", "rmse"),
    # Twenty flights of an independent implementation [N m]; two flights scatter by some per cent.
    [(PUBLISHED, 0.00497), (TUNED, 0.00230), (GATED, 0.00253), (GLR, 0.00181)],
)
def test_the_error_after_a_wheels_offset_is_that_of_an_independent_implementation(offset, contender, rmse):
    assert of(offset, contender, "rmse") == pytest.approx(rmse, rel=0.15)


def test_the_adaptive_filter_is_fast_after_the_fault_and_quiet_before_and_long_after(offset):
    assert of(offset, GATED, "first") < 1.0
    assert of(offset, GATED, "restless") == 0.0
    assert of(offset, GATED, "factor") > 6.0
    assert of(offset, GATED, "steady") == pytest.approx(of(offset, PUBLISHED, "steady"), rel=0.05)
    assert of(offset, GATED, "steady") < 0.1 * of(offset, TUNED, "steady")


def test_no_filter_fails_and_all_are_consistent_without_a_fault(offset):
    for name in offset.values:
        assert offset.failed[name].sum() == 0
        # 800 rows of 6 degrees in each of 2 flights: a standard deviation of sqrt(12 / 1600) = 0.087.
        assert of(offset, name, "nis") == pytest.approx(6.0, abs=0.35)


def test_the_flights_of_all_faults_have_the_same_noise_until_the_fault():
    records = [flight_of(each)(run_key(12, 0)) for each in SCENARIOS]
    before = np.asarray(records[0].truth["t"]) < ONSET
    for other in records[1:]:
        # Programs of their own round differently, and the loop carries it on.
        assert np.abs(records[0].samples.y[before] - other.samples.y[before]).max() < 1e-9
        assert np.abs(records[0].samples.y[~before] - other.samples.y[~before]).max() > 1e-3


def test_the_study_is_known_by_its_name_and_has_a_baseline_beside_each_fault():
    study = find_study("two-stage-fault-estimation")
    assert [each.baseline for each in study.experiments] == [TUNED, TUNED, TUNED, ""]
    assert len(study.claims) == 9
