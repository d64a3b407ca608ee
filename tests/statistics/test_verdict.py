import dataclasses

import equinox as eqx
import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import nis_test, verdict
from gainful.errors import ConfigError, Status


@pytest.fixture(scope="module")
def result(drifting):
    return gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)


def without_truth(result):
    return dataclasses.replace(result, log=dataclasses.replace(result.log, truth={}))


def test_sound_run_is_consistent_in_one_line(result):
    found = verdict(without_truth(result))
    assert found.consistent is True
    test = nis_test(result, 0.99)
    bounds = f"99 % bounds {test.lower:.2f} to {test.upper:.2f}"
    assert str(found) == f"consistent: NIS {test.mean:.2f} per degree ({bounds}), innovations white"
    assert found.problems == ()


def test_truth_adds_the_nees_and_the_bands(result):
    found = verdict(result)
    assert found.consistent is True
    assert [type(check).__name__ for check in found.checks] == [
        "ConsistencyTest",
        *["WhitenessTest"] * 2,
        "ConsistencyTest",
    ]
    assert ", NEES " in str(found)
    assert "effective degrees), truth inside the 95 % bands in 9" in str(found)


def test_verdict_is_sound_for_most_sound_runs(pendulum, many, results):
    estimator = gf.unscented_kalman_filter()
    found = [verdict(result) for result in results(pendulum, estimator, many(pendulum, estimator))]
    # Three checks at 99 %, and the whiteness of 60 rows is judged a little too strictly.
    assert np.mean([one.consistent is True for one in found]) > 0.92


def test_under_stated_noise_is_not_consistent_and_says_by_how_much(drifting):
    wrong = eqx.tree_at(
        lambda model: [part.noise.value for part in model.sensor_parts],
        drifting.model,
        [0.25 * part.noise.value for part in drifting.model.sensor_parts],
    )
    log = dataclasses.replace(drifting.log, truth={})
    found = verdict(gf.run(gf.kalman_filter(), wrong, drifting.prior, log))
    assert found.consistent is False
    test = found.checks[0]
    expected = f"NIS {test.mean:.2f} per degree (expected {test.lower:.2f} to {test.upper:.2f})"
    cause = "noise is under-stated by about 2 in sigma, or the model is off"
    assert str(found).startswith(f"not consistent: {expected}: {cause}")


def test_correlated_innovations_are_not_consistent(drifting, logged):
    drift = np.sin(2 * np.pi * np.arange(600) / 60)
    y = drifting.log.y.copy()
    y[:, 1] += drift
    found = verdict(gf.run(gf.kalman_filter(), drifting.model, drifting.prior, logged(y)))
    assert found.consistent is False
    assert "innovation of radar correlated (lag 1: 0." in str(found)


def test_errors_larger_than_claimed_are_not_consistent(result):
    shrunk = eqx.tree_at(lambda estimates: estimates.cov, result.estimates, result.estimates.cov / 16)
    found = verdict(dataclasses.replace(result, estimates=shrunk))
    assert found.consistent is False
    assert str(found).startswith("not consistent: NEES ")
    assert "errors are about 4 times larger than claimed; truth inside the 95 % bands in " in str(found)
    assert "(only " in str(found)


def test_rejected_missing_and_failed_rows_are_counted(drifting, logged):
    y = drifting.log.y.copy()
    y[[50, 150]] += 50.0
    y[250, 0] -= 50.0
    y[300:310] = np.nan
    gate = gf.Gated(probability=0.999999)
    result = gf.run(gf.kalman_filter(update=gate), drifting.model, drifting.prior, logged(y))
    found = verdict(without_truth(result))
    assert found.consistent is True
    assert found.facts == (
        "2 of 590 rows rejected",
        "1 of 590 rows partly rejected",
        "10 of 600 rows without a measurement",
    )
    assert str(found).endswith("innovations white, " + ", ".join(found.facts))
    weight = result.weight.copy()
    weight[500:504, 1] = 0.3
    faded = verdict(dataclasses.replace(without_truth(result), weight=weight))
    assert faded.facts[2] == "4 of 590 rows down-weighted"
    assert faded.checks[0].degrees == found.checks[0].degrees - 4
    status = result.status.copy()
    status[400:403] = Status.not_positive
    broken = verdict(dataclasses.replace(without_truth(result), status=status))
    assert broken.consistent is False
    assert str(broken).startswith("not consistent: 3 of 600 rows failed, first at t = 40 s: the innovation covariance")
    assert str(broken).endswith(
        "; 2 of 587 rows rejected, 1 of 587 rows partly rejected, 10 of 600 rows without a measurement"
    )


def test_too_little_to_judge_by_is_undecided(drifting, logged):
    log = dataclasses.replace(logged(drifting.log.y, rows=slice(0, 3)), truth={})
    found = verdict(gf.run(gf.kalman_filter(), drifting.model, drifting.prior, log))
    assert found.consistent is None
    assert str(found).startswith("undecided: NIS ")
    assert "not judged: 6 effective degrees, 10 are needed" in str(found)
    assert "innovation of laser not judged: 3 samples, at least 30 are needed" in str(found)


def test_nothing_measured_is_undecided_and_warned_of(drifting):
    log = gf.make_log(drifting.model, drifting.log.t, np.full_like(drifting.log.y, np.nan))
    found = verdict(gf.run(gf.kalman_filter(), drifting.model, drifting.prior, log))
    assert found.consistent is None
    assert str(found) == (
        "undecided: NIS not judged: no row could be counted, 600 of 600 rows without a measurement; "
        "warning: nothing was measured: the estimates are the prior carried forward"
    )


def test_small_bias_is_a_fact_not_a_problem(result):
    residual = result.residual.copy()
    sigma = np.sqrt(result.residual_cov[:, 0, 0])
    residual[:, 0] += sigma * (0.17 - np.mean(residual[:, 0] / sigma))
    found = verdict(without_truth(dataclasses.replace(result, residual=residual)))
    assert found.consistent is True
    assert found.facts == ("innovation of laser biased by 0.17 sigma",)


def test_smoothed_run_is_judged_by_the_filters_innovations(result):
    smoothed = gf.smooth(result)
    of_filter, of_smoother = verdict(result), verdict(smoothed)
    assert of_smoother.checks[0] == of_filter.checks[0]
    assert of_smoother.checks[-1] != of_filter.checks[-1]
    assert of_smoother.consistent is True


def test_level_of_a_verdict_must_be_a_probability(result):
    with pytest.raises(ConfigError, match="level: expected a probability between 0 and 1, got 99"):
        verdict(result, 99)
