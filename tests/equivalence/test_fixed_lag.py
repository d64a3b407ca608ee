"""Smoothing with a fixed lag lies between the filter and the smoother, row by row what a shorter record would give."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.filters import Info
from gainful.running import fixed_lag
from gainful.testing.cart import cart_model
from gainful.updates import InnovationScaling

from .problems import Linear, linear_model

FILTERS = {
    "dense": gf.extended_kalman_filter(),
    "square root": gf.unscented_kalman_filter(square_root=True),
    "two-stage, adaptive": gf.two_stage_extended_kalman_filter(update=InnovationScaling(gate=1.0, window=3)),
}


@pytest.fixture(scope="module")
def problem(generator: object) -> Linear:
    return Linear(generator("lag"))  # type: ignore[operator]


@pytest.fixture(scope="module")
def filtered(problem: Linear) -> gf.Result:
    return gf.run(gf.kalman_filter(), problem.model, problem.prior, problem.log)


def lagged(result: gf.Result, lag: float) -> Info:
    """What a compiled pipeline would make of it, without the shortcuts of `smooth`."""
    samples = gf.samples_of(result.log, float)
    _, info = gf.scan(result.estimator, result.model, result.prior, samples)
    return fixed_lag(result.estimator, result.model, samples, info, lag)


@pytest.mark.parametrize("lag", [0.05, 0.7, 2.5])
def test_each_row_is_batch_least_squares_of_the_rows_within_its_lag(
    lag: float, problem: Linear, filtered: gf.Result
) -> None:
    result = gf.smooth(filtered, lag=lag)
    until = np.searchsorted(problem.t, problem.t + lag + 1e-9, side="right")
    assert len(set(until - np.arange(len(until)))) > 1  # the steps are uneven, so the rows within a lag are
    for k, rows in enumerate(until):
        mean, cov = problem.least_squares(rows)
        np.testing.assert_allclose(result.mean[k], mean[k], rtol=0, atol=1e-11)
        np.testing.assert_allclose(result.cov[k], cov[k], rtol=0, atol=1e-11)


def test_without_a_lag_nothing_is_smoothed_not_even_within_a_moment(filtered: gf.Result) -> None:
    result = gf.smooth(filtered, lag=0.0)
    assert result.smoothed
    assert result.filtered is filtered
    np.testing.assert_array_equal(result.mean, filtered.mean)
    np.testing.assert_array_equal(result.cov, filtered.cov)


@pytest.mark.parametrize("name", FILTERS)
def test_a_lag_of_the_records_length_is_the_smoother(name: str) -> None:
    result = run_cart(FILTERS[name])
    smoothed, long = gf.smooth(result), lagged(result, 1e3)
    np.testing.assert_allclose(long.estimate.mean, smoothed.mean, rtol=0, atol=1e-12)
    np.testing.assert_allclose(jax.vmap(lambda each: each.cov)(long.estimate), smoothed.cov, rtol=0, atol=1e-12)
    # The shortcut for such a lag is the smoother itself.
    np.testing.assert_array_equal(gf.smooth(result, lag=1e3).mean, smoothed.mean)


@pytest.mark.parametrize("name", FILTERS)
def test_a_row_knows_of_nothing_after_its_lag(name: str) -> None:
    result, lag, first = run_cart(FILTERS[name]), 0.5, 12
    y = result.log.y.copy()
    y[first:, 0] += 1.0  # m
    other = gf.run(result.estimator, result.model, result.prior, dataclasses.replace(result.log, y=y))
    found, changed = gf.smooth(result, lag=lag), gf.smooth(other, lag=lag)
    knows = result.t + lag >= result.t[first] - 1e-9
    assert 0 < knows.sum() < len(knows)
    np.testing.assert_array_equal(found.mean[~knows], changed.mean[~knows])
    assert (np.abs(found.mean[knows] - changed.mean[knows]).max(axis=1) > 1e-6).all()


def test_the_longer_the_lag_the_less_uncertain(filtered: gf.Result) -> None:
    variances = [np.trace(gf.smooth(filtered, lag=lag).cov, axis1=1, axis2=2) for lag in (0.0, 0.5, 1.0, 2.0, 10.0)]
    assert (np.diff(variances, axis=0) <= 1e-14).all()
    assert (variances[-1] < variances[0])[:-1].all()


def test_lags_can_be_compiled_and_batched(filtered: gf.Result) -> None:
    samples = gf.samples_of(filtered.log, float)

    @jax.jit
    def means(lags: jax.Array) -> jax.Array:
        _, info = gf.scan(filtered.estimator, filtered.model, filtered.prior, samples)
        one = lambda lag: fixed_lag(filtered.estimator, filtered.model, samples, info, lag).estimate.mean  # noqa: E731
        return jax.vmap(one)(lags)

    lags = [0.0, 0.7, 2.5]
    for lag, mean in zip(lags, means(jnp.array(lags)), strict=True):
        np.testing.assert_allclose(mean, gf.smooth(filtered, lag=lag).mean, rtol=0, atol=1e-13)


def test_a_record_of_one_row_is_left_as_it_is() -> None:
    model = linear_model()
    log = gf.make_log(model, [0.0], [[0.1, 0.2]], [[0.0]])
    result = gf.run(gf.kalman_filter(), model, gf.make_prior(model, [0.0, 0.0], [1.0, 1.0]), log)
    np.testing.assert_array_equal(gf.smooth(result, lag=1.0).mean, result.mean)


def run_cart(estimator: gf.KalmanFilter) -> gf.Result:
    """A nonlinear model with an angle and a bias, on a record with uneven steps."""
    model = gf.augment(cart_model(), biases={"speed": 0.2})
    prior = gf.make_prior(model, {"x": 1.0, "heading": 3.1, "bias_speed": 0.0}, [0.3, 0.2, 0.5])
    t = np.cumsum(np.tile([0.1, 0.0, 0.2, 0.1], 5))
    log = gf.draw_log(model, prior, t, np.sin(t)[:, None], key=jax.random.key(4))
    return gf.run(estimator, model, prior, log)
