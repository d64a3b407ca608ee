"""Running moments of an error are what they are called."""

import jax.numpy as jnp
import numpy as np
import pytest

from gainful.control import ErrorStatistics


@pytest.mark.parametrize("full", [False, True])
def test_the_plain_mean_of_all_errors(full: bool, rng: np.random.Generator) -> None:
    errors = rng.normal(size=(50, 3)) + 2.0
    statistics = ErrorStatistics("mean", head_start=0.0, full=full)
    moments = statistics.init(3)
    for e in errors:
        moments = statistics.update(moments, jnp.asarray(e))
    covariance = np.cov(errors.T, bias=True)
    np.testing.assert_allclose(moments.mean, errors.mean(axis=0), rtol=1e-13)
    np.testing.assert_allclose(moments.variance, covariance if full else np.diag(covariance), rtol=1e-12)
    np.testing.assert_allclose(statistics.of(errors).variance, moments.variance, rtol=1e-12)


def test_what_was_known_counts_as_a_head_start(rng: np.random.Generator) -> None:
    before, after = rng.normal(size=(40, 2)), rng.normal(size=(60, 2)) + 1.0
    statistics = ErrorStatistics("mean", head_start=40.0)
    moments = statistics.of(before)
    for e in after:
        moments = statistics.update(moments, jnp.asarray(e))
    everything = np.concatenate([before, after])
    np.testing.assert_allclose(moments.mean, everything.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(moments.variance, everything.var(axis=0), rtol=1e-12)


def test_exponential_moments_weigh_errors_by_their_age(rng: np.random.Generator) -> None:
    errors, a = rng.normal(size=30), 0.2
    statistics = ErrorStatistics(rate=a)
    moments = statistics.init(1)
    for e in errors:
        moments = statistics.update(moments, jnp.asarray([e]))
    weights = a * (1.0 - a) ** np.arange(30)[::-1]
    start = (1.0 - a) ** 30  # of the zero it began with
    mean = weights @ errors
    np.testing.assert_allclose(moments.mean[0], mean, rtol=1e-12)
    np.testing.assert_allclose(moments.variance[0], weights @ (errors - mean) ** 2 + start * mean**2, rtol=1e-12)


def test_a_rate_of_one_keeps_the_latest_error_alone() -> None:
    statistics = ErrorStatistics(rate=1.0)
    moments = statistics.update(statistics.of([[3.0], [5.0]]), jnp.array([7.0]))
    assert float(moments.mean[0]) == 7.0
    assert float(moments.variance[0]) == 0.0


def test_variance_counts_if_asked_for() -> None:
    moments = ErrorStatistics().of([[1.0], [3.0]])
    assert ErrorStatistics(counts=False).counted(moments) is None
    np.testing.assert_allclose(ErrorStatistics().counted(moments), [1.0])
