"""The library against dynamax on the same data."""

import warnings
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf

from .textbook import Pendulum

with warnings.catch_warnings():
    # Its dependencies warn on import; warnings are errors here.
    warnings.simplefilter("ignore")
    peer = pytest.importorskip(
        "dynamax.nonlinear_gaussian_ssm", reason="dynamax is a peer to compare with, not a dependency"
    )

BOOST = 1e-9
"""dynamax adds this to the diagonal of S before it solves; against the smallest eigenvalue of S, above 0.009, the gain is
off by 1.1e-7 of itself, and with it each row."""
TOLERANCE = 10 * BOOST / 0.009


@pytest.fixture(scope="module")
def parameters(pendulum: Pendulum) -> object:
    plant = Pendulum(jnp)
    return peer.ParamsNLGSSM(
        initial_mean=jnp.asarray(pendulum.mean),
        initial_covariance=jnp.asarray(pendulum.cov),
        dynamics_function=plant.f,
        dynamics_covariance=jnp.asarray(pendulum.Q),
        emission_function=plant.h,
        emission_covariance=jnp.asarray(pendulum.R),
    )


def _compare(result: gf.Result, found: object) -> None:
    smoothed = gf.smooth(result)
    for ours, name in (
        (result.mean, "filtered_means"),
        (result.cov, "filtered_covariances"),
        (smoothed.mean, "smoothed_means"),
        (smoothed.cov, "smoothed_covariances"),
    ):
        np.testing.assert_allclose(ours, getattr(found, name), rtol=0, atol=TOLERANCE, err_msg=name)
    # The density uses S as it is, at means that are off by the tolerance: of 40 rows the sum.
    assert result.log_likelihood.sum() == pytest.approx(float(found.marginal_loglik), abs=40 * TOLERANCE)  # type: ignore[attr-defined]


@pytest.mark.filterwarnings("ignore")
def test_the_extended_filter_and_smoother_agree(
    parameters: object, record: np.ndarray, filtered: Callable[..., gf.Result]
) -> None:
    found = peer.extended_kalman_smoother(parameters, jnp.asarray(record))
    _compare(filtered(gf.extended_kalman_filter()), found)


@pytest.mark.filterwarnings("ignore")
def test_the_unscented_filter_and_smoother_agree(
    parameters: object, record: np.ndarray, filtered: Callable[..., gf.Result]
) -> None:
    settings = peer.UKFHyperParams(alpha=1.0, beta=2.0, kappa=0.0)
    found = peer.unscented_kalman_smoother(parameters, jnp.asarray(record), settings)
    _compare(filtered(gf.unscented_kalman_filter()), found)
