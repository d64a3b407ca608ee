"""A ship's track: displacement and speed, fixes of its displacement, and a filter whose noise is wrong."""

from __future__ import annotations

import numpy as np
import scipy.linalg

import gainful as gf
from gainful.estimates import Gaussian
from gainful.models import Model

H = 10.0  # s
F = np.array([[1.0, H], [0.0, 1.0]])
DESIGN = (1.4, 0.005, 0.4)  # m, m/s, m: what the filter believes of steps, changes of speed and fixes
TRUTH = (1.4, 0.046, 0.08)  # what they are


def track_model(sigmas: tuple[float, float, float] = DESIGN) -> Model:
    step, speed, fix = sigmas
    return gf.linear_model(
        F, [[1.0, 0.0]], Q=[step**2, speed**2], R=fix**2, states={"x": "m", "v": "m/s"}, outputs={"fix": "m"}
    )


def steady(sigmas: tuple[float, float, float] = DESIGN) -> tuple[np.ndarray, np.ndarray]:
    """Covariance after an update, and gain, of a filter that has settled."""
    step, speed, fix = sigmas
    cov = scipy.linalg.solve_discrete_are(
        F.T, np.array([[1.0], [0.0]]), np.diag([step**2, speed**2]), fix**2 * np.eye(1)
    )
    gain = cov[:, :1] / (cov[0, 0] + fix**2)
    return cov - gain @ cov[:1], gain


def prior() -> Gaussian:
    return gf.make_prior(track_model(), [0.0, 5.0], cov=steady()[0])


def tracks(
    rng: np.random.Generator, count: int, rows: int = 120, sigmas: tuple[float, float, float] = TRUTH
) -> list[gf.Log]:
    """Records of a true track from where the filter believes to start."""
    logs = []
    for _ in range(count):
        x, states = np.array([0.0, 5.0]) + np.linalg.cholesky(steady()[0]) @ rng.normal(size=2), []
        for _ in range(rows):
            x = F @ x + rng.normal(size=2) * sigmas[:2]
            states.append(x)
        x, v = np.array(states).T
        fixes = x + rng.normal(size=rows) * sigmas[2]
        logs.append(gf.make_log(track_model(), H * np.arange(1, rows + 1), fixes, truth={"x": x, "v": v}, start=0.0))
    return logs


def static_bound(truth: tuple[float, float, float] = TRUTH) -> tuple[np.ndarray, np.ndarray]:
    """Error variances of the settled design filter, and the least that any map of the present innovation leaves of them."""
    gain, h = steady()[1], np.array([[1.0, 0.0]])
    keep = np.eye(2) - gain @ h
    noise, fix = np.diag([truth[0] ** 2, truth[1] ** 2]), truth[2] ** 2
    driven = keep @ noise @ keep.T + fix * gain @ gain.T
    cov = scipy.linalg.solve_discrete_lyapunov(keep @ F, driven)
    ahead = F @ cov @ F.T + noise
    cross = keep @ ahead[:, :1] - gain * fix
    return np.diag(cov), np.diag(cov - cross @ cross.T / (ahead[0, 0] + fix))
