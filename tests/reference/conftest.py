"""The pendulum run once by each filter, for all peers to be compared with."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf

from .textbook import STEP, Pendulum

ROWS = 40


@pytest.fixture(scope="session")
def pendulum() -> Pendulum:
    return Pendulum()


@pytest.fixture(scope="session")
def record(pendulum: Pendulum) -> np.ndarray:
    return pendulum.record(ROWS)


@pytest.fixture(scope="session")
def filtered(pendulum: Pendulum, record: np.ndarray) -> Callable[..., gf.Result]:
    plant = Pendulum(jnp)
    model = gf.discrete_model(
        lambda x: plant.f(x), lambda x: plant.h(x), states=2, outputs=2, Q=pendulum.Q, R=pendulum.R
    )
    prior = gf.make_prior(model, pendulum.mean, cov=pendulum.cov)
    found: dict[gf.KalmanFilter, gf.Result] = {}

    def run(estimator: gf.KalmanFilter) -> gf.Result:
        if estimator not in found:
            found[estimator] = gf.run(estimator, model, prior, gf.make_log(model, STEP * np.arange(ROWS), record))
        return found[estimator]

    return run
