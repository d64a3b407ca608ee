"""Every combination of parts gives the same numbers however it is run."""

import equinox as eqx
import jax
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
