"""Every combination of parts gives the same numbers however it is run."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.filters import AbstractEstimator
from gainful.models import AbstractModel
from gainful.testing import check_estimator
from gainful.testing.cart import cart_model, cart_prior, record
from gainful.testing.comparisons import assert_same_estimate

from .parts import ESTIMATORS, combinations, flat, name_of


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "combination" in metafunc.fixturenames:
        metafunc.parametrize("combination", combinations(metafunc.config.getoption("--full")), ids=name_of)


def test_a_filter_gives_the_same_compiled_step_by_step_and_in_a_batch(combination: gf.KalmanFilter) -> None:
    # Iterations and sigma points repeat rounding a few times; differences seen are below 1e-12.
    # Square roots are slow without compiling, so their single steps are compiled here, and one is not below.
    check_estimator(combination, eager=combination.estimate is gf.Gaussian, tolerance=1e-10)


def test_a_square_root_step_is_the_same_without_compiling() -> None:
    model, prior = cart_model(), cart_prior()
    estimator = gf.kalman_filter(square_root=True)
    sample = jax.tree.map(lambda leaf: leaf[-1], record(model, prior.mean, jax.random.key(1)))
    carry = estimator.init(model, prior)
    eager, compiled = estimator.step(model, carry, sample)[1], eqx.filter_jit(estimator.step)(model, carry, sample)[1]
    assert_same_estimate(compiled.estimate, eager.estimate, "jit = eager", tolerance=1e-12)


@pytest.mark.parametrize(("estimator", "model"), flat(ESTIMATORS))
def test_an_estimator_gives_the_same_compiled_step_by_step_and_in_a_batch(
    estimator: AbstractEstimator, model: AbstractModel | None
) -> None:
    check_estimator(estimator, model)


def _rooted(x: jax.Array, u: jax.Array) -> jax.Array:
    return 0.9 * x + jnp.sqrt(u)


def _partly_rooted(x: jax.Array, u: jax.Array) -> jax.Array:
    return jnp.stack([x[0], x[0] + jnp.sqrt(u[0])])


@pytest.fixture(scope="module")
def one_bad_input() -> np.ndarray:
    """Inputs that no root can be taken of in row 5."""
    return np.where(np.arange(10) == 5, -1.0, 1.0)


@pytest.mark.parametrize("square_root", [False, True])
def test_what_is_not_measured_need_not_be_finite(one_bad_input: np.ndarray, square_root: bool) -> None:
    model = gf.discrete_model(lambda x: 0.9 * x, _partly_rooted, states=1, outputs=2, inputs=1, Q=0.1, R=[0.1, 0.1])
    y = np.ones((10, 2))
    y[5, 1] = np.nan
    estimator = gf.unscented_kalman_filter(square_root=square_root)
    result = gf.run(
        estimator, model, gf.make_prior(model, [1.0], [1.0]), gf.make_log(model, np.arange(10), y, one_bad_input)
    )
    assert result.counts() == {"ok": 10}
    assert np.isfinite(result.mean).all()


def test_a_row_that_failed_spoils_no_other_row_neither_filtered_nor_smoothed(one_bad_input: np.ndarray) -> None:
    model = gf.discrete_model(_rooted, lambda x: x, states=1, outputs=1, inputs=1, Q=0.1, R=0.1)
    log = gf.make_log(model, np.arange(10), np.ones(10), one_bad_input)
    result = gf.run(gf.kalman_filter(), model, gf.make_prior(model, [1.0], [1.0]), log, throw=False)
    assert result.counts() == {"ok": 9, "nonfinite": 1}
    np.testing.assert_array_equal(result.mean[5], result.mean[4])  # the last good estimate
    assert np.isfinite(result.mean).all()
    smoothed = gf.smooth(result)
    assert np.isfinite(smoothed.mean).all()
    assert np.isfinite(smoothed.cov).all()
