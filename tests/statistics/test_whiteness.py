import dataclasses

import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import ljung_box, whiteness_tests
from gainful.errors import ConfigError


@pytest.fixture(scope="module")
def result(drifting):
    return gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)


def with_residual(result, values, signal=0):
    """The result with other normalised innovations of one signal."""
    residual = result.residual.copy()
    residual[:, signal] = values * np.sqrt(result.residual_cov[:, signal, signal])
    return dataclasses.replace(result, residual=residual)


def coloured(memory, rows=600, seed=1):
    noise, values = np.random.default_rng(seed).standard_normal(rows), np.zeros(rows)
    for k in range(rows):
        values[k] = memory * values[k - 1] + np.sqrt(1 - memory**2) * noise[k]
    return values


def test_innovations_of_a_sound_filter_are_white(result):
    tests = whiteness_tests(result)
    assert [test.signal for test in tests] == ["laser", "radar"]
    assert [test.sentence for test in tests] == ["innovation of laser white", "innovation of radar white"]
    assert all(test.passed and test.probability > 0.025 for test in tests)


def test_coloured_sensor_noise_is_flagged_on_its_own_signal(drifting, logged):
    y = drifting.log.y.copy()
    y[:, 1] = drifting.log.truth["position"] + np.sqrt(0.4) * coloured(0.8)
    laser, radar = whiteness_tests(gf.run(gf.kalman_filter(), drifting.model, drifting.prior, logged(y)))
    assert laser.passed is True
    assert radar.passed is False
    assert radar.worst_lag == 1
    assert radar.sentence == f"innovation of radar correlated (lag 1: {radar.autocorrelation[0]:.2f})"
    assert radar.autocorrelation[0] == pytest.approx(0.8, abs=0.1)


def test_white_series_pass_as_often_as_the_level_says(result):
    generator = np.random.default_rng(2)
    passed = [whiteness_tests(with_residual(result, generator.standard_normal(600)))[0] for _ in range(400)]
    # Each of two signals is allowed half of the 5 %.
    assert 0.94 < np.mean([test.probability > 0.025 for test in passed]) < 0.995


def test_lasting_bias_counts_as_correlation_and_is_named(result):
    values = coloured(0.0) + 1.0
    test = whiteness_tests(with_residual(result, values))[0]
    assert test.passed is False
    assert test.sentence.endswith(f"and biased by {values.mean():.2g} sigma")


def test_small_bias_that_leaves_innovations_white_is_still_named(result):
    values = coloured(0.0, seed=2)
    test = whiteness_tests(with_residual(result, values - values.mean() + 0.15))[0]
    assert test.passed is True
    assert test.sentence == "innovation of laser white but biased by 0.15 sigma"


def test_tiny_correlation_of_a_long_record_is_practically_white(result):
    rows = 60_000
    record = gf.make_log(result.model, np.arange(float(rows)), np.zeros((rows, 2)))
    tall = {name: np.concatenate([getattr(result, name)] * 100) for name in ("nis", "weight", "status", "residual_cov")}
    for memory, passed in ((0.04, True), (0.1, False)):
        long = dataclasses.replace(result, log=record, residual=np.zeros((rows, 2)), **tall)
        test = whiteness_tests(with_residual(long, coloured(memory, rows)))[0]
        assert test.probability < 1e-6
        assert test.passed is passed


def test_only_measured_and_used_components_count(drifting, logged):
    y = drifting.log.y.copy()
    y[::2, 1] = np.nan
    y[200, 0] += 100.0
    result = gf.run(gf.kalman_filter(update=gf.Gated()), drifting.model, drifting.prior, logged(y))
    rejected = result.weight[:, 0] == 0
    laser, radar = whiteness_tests(result)
    assert rejected[200]
    assert laser.samples == 600 - rejected.sum()
    assert radar.samples == 300 - (result.weight[1::2, 1] == 0).sum()
    assert laser.passed is True
    assert laser.mean == pytest.approx(
        np.mean((result.residual[:, 0] / np.sqrt(result.residual_cov[:, 0, 0]))[~rejected])
    )


def test_few_samples_are_not_judged(drifting, logged):
    log = logged(drifting.log.y, rows=slice(0, 29))
    for test in whiteness_tests(gf.run(gf.kalman_filter(), drifting.model, drifting.prior, log)):
        assert test.passed is None
        assert (test.worst_lag, test.worst, test.biased) == (0, 0.0, False)
        assert test.sentence == f"innovation of {test.signal} not judged: 29 samples, at least 30 are needed"


def test_number_of_lags_follows_the_record_or_the_caller(drifting, logged, result):
    assert len(whiteness_tests(result)[0].autocorrelation) == 20
    assert len(whiteness_tests(result, lags=7)[0].autocorrelation) == 7
    short = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, logged(drifting.log.y, rows=slice(0, 29 * 3)))
    assert len(whiteness_tests(short)[0].autocorrelation) == 8


def test_ljung_box_agrees_with_statsmodels():
    diagnostic = pytest.importorskip("statsmodels.stats.diagnostic")
    values = coloured(0.2, 200)
    # The other package takes out the mean, which here is known to be zero.
    values -= values.mean()
    rho, statistic, probability = ljung_box(values, 8)
    table = diagnostic.acorr_ljungbox(values, lags=[8])
    assert statistic == pytest.approx(float(table["lb_stat"].iloc[0]), rel=1e-9)
    assert probability == pytest.approx(float(table["lb_pvalue"].iloc[0]), rel=1e-6)
    assert rho[0] == pytest.approx(values[:-1] @ values[1:] / (values @ values))


def test_silent_series_has_no_correlation():
    rho, statistic, probability = ljung_box(np.zeros(50), 5)
    assert (rho.tolist(), statistic, probability) == ([0.0] * 5, 0.0, 1.0)


def test_wrong_arguments_are_named(result):
    with pytest.raises(ConfigError, match="level: expected a probability between 0 and 1, got 2"):
        whiteness_tests(result, level=2.0)
    with pytest.raises(ConfigError, match="lags: expected at least 1, got 0"):
        whiteness_tests(result, lags=0)
    with pytest.raises(ConfigError, match="lags: expected 1 to 4 for 5 values, got 5"):
        ljung_box(np.ones(5), 5)
