"""Every combination of parts gives the same numbers however it is run."""

import pytest

import gainful as gf
from gainful.filters import AbstractEstimator
from gainful.models import AbstractModel
from gainful.testing import check_estimator

from .parts import ESTIMATORS, combinations, flat, name_of


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "combination" in metafunc.fixturenames:
        metafunc.parametrize("combination", combinations(metafunc.config.getoption("--full")), ids=name_of)


def test_a_filter_gives_the_same_compiled_step_by_step_and_in_a_batch(combination: gf.KalmanFilter) -> None:
    # Iterations and sigma points repeat rounding a few times; differences seen are below 1e-12.
    check_estimator(combination, tolerance=1e-10)


@pytest.mark.parametrize(("estimator", "model"), flat(ESTIMATORS))
def test_an_estimator_gives_the_same_compiled_step_by_step_and_in_a_batch(
    estimator: AbstractEstimator, model: AbstractModel | None
) -> None:
    check_estimator(estimator, model)
