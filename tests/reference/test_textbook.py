"""The library against textbook formulas written out in NumPy."""

from collections.abc import Callable

import numpy as np
import pytest

import gainful as gf

from .textbook import Pendulum, extended, kalman, unscented

ROUNDING = 1e-12
"""Forty rows of well-conditioned 2 x 2 problems: a few hundred eps."""


@pytest.mark.parametrize(("n", "m", "square_root"), [(1, 1, False), (3, 2, False), (4, 2, True)])
def test_random_linear_models_are_filtered_and_smoothed_as_kalman_and_rauch_did(
    n: int, m: int, square_root: bool, rng: np.random.Generator
) -> None:
    F = np.linalg.qr(rng.normal(size=(n, n)))[0] * rng.uniform(0.8, 1.0)
    H, q, r, p = (rng.normal(size=shape) for shape in ((m, n), (n, n), (m, m), (n, n)))
    Q, R, P = q @ q.T * 0.1 + 0.01 * np.eye(n), r @ r.T + 0.2 * np.eye(m), p @ p.T + 0.1 * np.eye(n)
    x, ys = rng.normal(size=n), rng.normal(size=(20, m))
    ys[rng.random(size=ys.shape) < 0.2] = np.nan
    ys[7] = np.nan
    model = gf.linear_model(F, H, Q=Q, R=R)
    result = gf.run(
        gf.kalman_filter(square_root=square_root),
        model,
        gf.make_prior(model, x, cov=P),
        gf.make_log(model, np.arange(20), ys),
    )
    expected = kalman(x, P, F, H, Q, R, ys)
    # Condition numbers of S and of the predicted covariance stay below 1e3.
    for name in ("mean", "cov", "log_likelihood"):
        np.testing.assert_allclose(getattr(result, name), expected[name], rtol=0, atol=ROUNDING, err_msg=name)
    smoothed = gf.smooth(result)
    np.testing.assert_allclose(smoothed.mean, expected["smooth"], rtol=0, atol=10 * ROUNDING)
    np.testing.assert_allclose(smoothed.cov, expected["smooth_cov"], rtol=0, atol=10 * ROUNDING)


def test_the_extended_filter_is_the_one_with_jacobians_by_hand(
    pendulum: Pendulum, record: np.ndarray, filtered: Callable[..., gf.Result]
) -> None:
    p = pendulum
    mean, cov = extended(p.mean, p.cov, p.f, p.F, p.h, p.H, p.Q, p.R, record)
    result = filtered(gf.extended_kalman_filter())
    np.testing.assert_allclose(result.mean, mean, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(result.cov, cov, rtol=0, atol=ROUNDING)


def test_the_unscented_filter_is_julier_and_uhlmanns(
    pendulum: Pendulum, record: np.ndarray, filtered: Callable[..., gf.Result]
) -> None:
    p = pendulum
    # The unscaled transform: alpha = 1 and beta = 0 leave the weights of 2004.
    mean, cov = unscented(p.mean, p.cov, p.f, p.h, p.Q, p.R, record, kappa=1.0)
    result = filtered(gf.unscented_kalman_filter(alpha=1.0, beta=0.0, kappa=1.0))
    np.testing.assert_allclose(result.mean, mean, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(result.cov, cov, rtol=0, atol=ROUNDING)
