"""The study of two-stage fault estimation on a small budget: its numbers, as far as a few flights tell them."""

import dataclasses

import equinox as eqx
import numpy as np
import pytest

from gainful.studies import Outcome, find_study
from gainful.studies.monte_carlo import run_experiment, run_key
from gainful.studies.two_stage_fault_estimation import detection, mean_propagation, misset_noise
from gainful.studies.two_stage_fault_estimation.contenders import GATED, GLR, PUBLISHED, TUNED, contenders
from gainful.studies.two_stage_fault_estimation.estimation import experiment
from gainful.studies.two_stage_fault_estimation.misset_noise import CONSERVATIVE, OPTIMISTIC, RESTLESS, RIGHT, told
from gainful.studies.two_stage_fault_estimation.scenarios import OFFSET, ONSET, SCENARIOS, flight_of
from gainful.studies.two_stage_fault_estimation.tuning import GRIDS

RUNS = 2


@pytest.fixture(scope="module")
def offset():
    chosen = {name: each for name, each in contenders(OFFSET).items() if name in (PUBLISHED, TUNED, GATED, GLR)}
    return run_experiment(experiment(OFFSET, chosen, baseline=TUNED), RUNS, 12, quick=True)


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


@pytest.fixture(scope="module")
def misset():
    """The same programs, told other noise."""
    names = [told(name, noise) for name in (TUNED, GATED) for noise in (RIGHT, OPTIMISTIC, CONSERVATIVE, RESTLESS)]
    chosen = {name: each for name, each in misset_noise.contenders(OFFSET).items() if name in names}
    return run_experiment(experiment(OFFSET, chosen), RUNS, 12, quick=True)


def test_told_the_right_noise_the_filters_are_those_of_the_main_table(offset, misset):
    for name in (TUNED, GATED):
        np.testing.assert_array_equal(misset.values[told(name, RIGHT)]["rmse"], offset.values[name]["rmse"])


@pytest.mark.parametrize(
    ("contender", "noise", "rmse"),
    # Twenty flights of an independent implementation [N m].
    [
        (TUNED, OPTIMISTIC, 0.0026),
        (TUNED, CONSERVATIVE, 0.0024),
        (TUNED, RESTLESS, 0.0066),
        (GATED, OPTIMISTIC, 0.0176),
        (GATED, CONSERVATIVE, 0.0030),
        (GATED, RESTLESS, 0.0066),
    ],
)
def test_the_error_with_wrong_noise_is_that_of_an_independent_implementation(misset, contender, noise, rmse):
    assert of(misset, told(contender, noise), "rmse") == pytest.approx(rmse, rel=0.15)


def test_the_gate_cannot_close_where_r_is_too_small(misset):
    assert of(misset, told(GATED, OPTIMISTIC), "restless") > 0.9
    assert of(misset, told(GATED, CONSERVATIVE), "restless") == 0.0


PLAIN = [each for each in detection.STATISTICS if each != detection.RATIO]


@pytest.fixture(scope="module")
def detected():
    """The chapter's two plain filters for the offset, six flights without a fault and two with one."""
    study = find_study("two-stage-fault-estimation")
    results = {}
    for name, runs in ((detection.sound(OFFSET), 6), (detection.faulty(OFFSET), RUNS)):
        (made,) = (each for each in study.experiments if each.name == name)
        chosen = {filtered: made.contenders[filtered] for filtered in (PUBLISHED, TUNED)}
        results[name] = run_experiment(dataclasses.replace(made, contenders=chosen), runs, 12, quick=True)
    return Outcome(study, RUNS, 12, results)


def test_thresholds_have_one_alarm_in_a_thousand_seconds(detected):
    for statistic in PLAIN:
        chosen = detection.threshold(detected, OFFSET, statistic)
        # 6 flights of 190 s: the highest of all bursts.
        assert chosen.events == 1
        settled = detected.record(detection.sound(OFFSET)).truth["t"] - 0.05 >= 10.0
        values = detection.series(detected, detection.sound(OFFSET), statistic)[:, settled]
        assert chosen.value == np.nanmax(values)
    assert detection.threshold(detected, OFFSET, detection.SINGLE, 1e-4) is None


def test_every_statistic_finds_an_offset_within_half_a_second(detected):
    for statistic in PLAIN:
        limit = detection.threshold(detected, OFFSET, statistic).value
        late = detection.delays(detected, OFFSET, statistic, limit)
        assert (late > 0).all()  # a torque moves the rates one step later
        assert (late <= 0.5).all()


def test_the_likelihood_ratio_rises_where_the_fault_comes(offset):
    t, ratio = offset.record.truth["t"], offset.traces[GLR]["ratio"].first
    assert ratio[(t >= 10.0) & (t < ONSET)].max() < 30.0
    assert ratio[(t >= ONSET) & (t < ONSET + 0.5)].max() > 30.0
    assert (offset.traces[PUBLISHED]["ratio"].first == 0).all()


def test_without_noise_only_a_mean_moved_otherwise_errs():
    orbit = mean_propagation.chapter().experiments[1]
    wanted = [
        mean_propagation.named(mean_propagation.EXTENDED, each)
        for each in (mean_propagation.RUNGE_KUTTA, mean_propagation.EULER, mean_propagation.LINEARISED)
    ]
    orbit = dataclasses.replace(orbit, contenders={name: orbit.contenders[name] for name in wanted})
    found = run_experiment(orbit, 1, 12)
    exact, euler, linearised = (of(found, name, "before") for name in wanted)
    # An independent implementation: 2e-7, 6e-3, and 0.6 deg/s for a filter whose covariance was linearised likewise.
    assert exact < 2e-7
    assert euler == pytest.approx(6e-3, rel=0.1)
    assert 0.4 < linearised < 0.8


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda each: each.name)
def test_every_setting_in_use_is_in_the_grid_it_was_tuned_on(scenario):
    used = contenders(scenario)
    for name, grid in GRIDS.items():
        assert any(eqx.tree_equal(used[name], setting) for setting in grid(scenario).values()), name


def test_the_study_is_known_by_its_name_and_has_a_baseline_beside_each_fault():
    study = find_study("two-stage-fault-estimation")
    assert [each.baseline for each in study.experiments[:3]] == [TUNED, TUNED, TUNED]
    assert [each.name for each in study.experiments[:3]] == [each.name for each in SCENARIOS]
