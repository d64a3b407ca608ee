"""The library against filterpy 2 on the same data."""

from collections.abc import Callable

import numpy as np
import pytest

import gainful as gf

from .textbook import STEP, Pendulum

kalman = pytest.importorskip("filterpy.kalman", reason="filterpy is a peer to compare with, not a dependency")

ROUNDING = 1e-11
"""filterpy inverts S and subtracts K S K^T, which costs the condition number of S, below 100, times eps, each row."""


def _loop(peer: object, ys: np.ndarray, update: Callable) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    means, covs, densities = [], [], []
    for k, y in enumerate(ys):
        if k:
            peer.predict()  # type: ignore[attr-defined]
        update(None if np.isnan(y).any() else y)
        means.append(peer.x.copy())  # type: ignore[attr-defined]
        covs.append(peer.P.copy())  # type: ignore[attr-defined]
        densities.append(0.0 if np.isnan(y).any() else peer.log_likelihood)  # type: ignore[attr-defined]
    return np.array(means), np.array(covs), np.array(densities)


def test_the_linear_filter_and_smoother_agree_with_missing_rows(rng: np.random.Generator) -> None:
    F, H = np.array([[1.0, STEP], [0.0, 1.0]]), np.array([[1.0, 0.0], [0.5, 1.0]])
    Q, R = np.array([[0.02, 0.01], [0.01, 0.05]]), np.array([[0.3, 0.1], [0.1, 0.2]])
    ys = rng.normal(size=(25, 2))
    ys[[6, 7, 15]] = np.nan
    peer = kalman.KalmanFilter(dim_x=2, dim_z=2)
    peer.x, peer.P, peer.F, peer.H, peer.Q, peer.R = np.zeros(2), 2.0 * np.eye(2), F, H, Q, R
    mean, cov, density = _loop(peer, ys, peer.update)
    model = gf.linear_model(F, H, Q=Q, R=R)
    prior = gf.make_prior(model, np.zeros(2), cov=2.0 * np.eye(2))
    result = gf.run(gf.kalman_filter(), model, prior, gf.make_log(model, np.arange(25), ys))
    np.testing.assert_allclose(result.mean, mean, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(result.cov, cov, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(result.log_likelihood, density, rtol=0, atol=ROUNDING)
    smooth_mean, smooth_cov, *_ = peer.rts_smoother(mean, cov)
    smoothed = gf.smooth(result)
    np.testing.assert_allclose(smoothed.mean, smooth_mean, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(smoothed.cov, smooth_cov, rtol=0, atol=ROUNDING)


def test_the_extended_filter_agrees(pendulum: Pendulum, record: np.ndarray, filtered: Callable[..., gf.Result]) -> None:
    class Peer(kalman.ExtendedKalmanFilter):
        def predict_x(self, u: float = 0) -> None:
            self.F = pendulum.F(self.x)  # before the step: filterpy leaves it to the user
            self.x = pendulum.f(self.x)

    peer = Peer(dim_x=2, dim_z=2)
    peer.x, peer.P, peer.Q, peer.R = pendulum.mean, pendulum.cov, pendulum.Q, pendulum.R
    mean, cov, density = _loop(peer, record, lambda y: peer.update(y, pendulum.H, pendulum.h))
    result = filtered(gf.extended_kalman_filter())
    np.testing.assert_allclose(result.mean, mean, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(result.cov, cov, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(result.log_likelihood, density, rtol=0, atol=100 * ROUNDING)


@pytest.mark.parametrize(("alpha", "beta", "kappa"), [(1.0, 2.0, 0.0), (0.3, 2.0, 1.0)])
def test_the_unscented_filter_and_smoother_agree(
    alpha: float, beta: float, kappa: float, pendulum: Pendulum, record: np.ndarray, filtered: Callable[..., gf.Result]
) -> None:
    points = kalman.MerweScaledSigmaPoints(2, alpha=alpha, beta=beta, kappa=kappa)
    peer = kalman.UnscentedKalmanFilter(
        dim_x=2, dim_z=2, dt=STEP, hx=pendulum.h, fx=lambda x, dt: pendulum.f(x), points=points
    )
    peer.x, peer.P, peer.Q, peer.R = pendulum.mean, pendulum.cov, pendulum.Q, pendulum.R
    # filterpy 2 draws new points after predict, but only then: before the first row they are drawn by hand.
    peer.sigmas_f = points.sigma_points(peer.x, peer.P)
    mean, cov, density = _loop(peer, record, peer.update)
    result = filtered(gf.unscented_kalman_filter(alpha=alpha, beta=beta, kappa=kappa))
    np.testing.assert_allclose(result.mean, mean, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(result.cov, cov, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(result.log_likelihood, density, rtol=0, atol=100 * ROUNDING)
    smooth_mean, smooth_cov, _ = peer.rts_smoother(mean, cov)
    smoothed = gf.smooth(result)
    np.testing.assert_allclose(smoothed.mean, smooth_mean, rtol=0, atol=10 * ROUNDING)
    np.testing.assert_allclose(smoothed.cov, smooth_cov, rtol=0, atol=10 * ROUNDING)
