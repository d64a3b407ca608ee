"""The small problems that the boundary tests share, so that few programs are compiled."""

from __future__ import annotations

import functools
from typing import Any

import jax.numpy as jnp
import numpy as np

import gainful as gf

GRAVITY = 9.81  # m/s^2, over a length of 1 m
STEP = 0.02  # s
ROWS = 200
Q = np.diag([1e-6, 1e-4])
R = 0.01
MEAN, STD = np.array([1.0, 0.0]), np.array([0.3, 0.3])
PENDULUM = {"theta": "rad", "omega": "rad/s"}
ESTIMATORS = {"ekf": gf.extended_kalman_filter(), "ukf": gf.unscented_kalman_filter()}


def swing(x, u, t):
    """One step of a pendulum."""
    return jnp.array([x[0] + STEP * x[1], x[1] - STEP * GRAVITY * jnp.sin(x[0])])


def horizontal(x, u, t):
    """Where the bob hangs, across [m]."""
    return jnp.sin(x[:1])


def pendulum(**changes: Any) -> gf.models.AbstractModel:
    """The pendulum of the peers' test of bad input, with something changed."""
    given = {"f": swing, "h": horizontal, "states": PENDULUM, "outputs": {"across": "m"}, "Q": Q, "R": R} | changes
    return gf.discrete_model(given.pop("f"), given.pop("h"), **given)


@functools.cache
def swung() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, true states and measurements; drawn without the library."""
    rng = np.random.default_rng(7)
    x, states = np.array([1.2, 0.1]), []
    for _ in range(ROWS):
        states.append(x)
        x = np.array([x[0] + STEP * x[1], x[1] - STEP * GRAVITY * np.sin(x[0])]) + np.sqrt(np.diag(Q)) * rng.normal(
            size=2
        )
    truth = np.array(states)
    y = np.sin(truth[:, :1]) + np.sqrt(R) * rng.normal(size=(ROWS, 1))
    return np.arange(ROWS) * STEP, truth, y


def numpy_ekf(t: np.ndarray, y: np.ndarray, R: float = R) -> np.ndarray:
    """The extended filter along the pendulum's record in plain NumPy; rows with NaN are predicted only."""
    x, P, out = MEAN.copy(), np.diag(STD**2), []
    for k in range(len(t)):
        if k and t[k] > t[k - 1]:
            F = np.array([[1.0, STEP], [-STEP * GRAVITY * np.cos(x[0]), 1.0]])
            x = np.array([x[0] + STEP * x[1], x[1] - STEP * GRAVITY * np.sin(x[0])])
            P = F @ P @ F.T + Q
        if np.isfinite(y[k, 0]):
            H = np.array([[np.cos(x[0]), 0.0]])
            K = P @ H.T / (H @ P @ H.T + R)
            x, P = x + K[:, 0] * (y[k, 0] - np.sin(x[0])), (np.eye(2) - K @ H) @ P
        out.append(x)
    return np.array(out)


def numpy_ukf(t: np.ndarray, y: np.ndarray, R: float = R) -> np.ndarray:
    """The unscented filter (alpha 1, beta 2, kappa 0) likewise, points drawn anew before each update."""
    n = 2
    mean_weights = np.array([0.0, *[0.25] * 4])
    cov_weights = mean_weights + np.array([2.0, *[0.0] * 4])
    x, P, out = MEAN.copy(), np.diag(STD**2), []

    def points() -> np.ndarray:
        spread = np.sqrt(n) * np.linalg.cholesky(P).T
        return np.concatenate([x[None], x + spread, x - spread])

    for k in range(len(t)):
        if k and t[k] > t[k - 1]:
            moved = points()
            moved = np.stack(
                [moved[:, 0] + STEP * moved[:, 1], moved[:, 1] - STEP * GRAVITY * np.sin(moved[:, 0])], axis=1
            )
            x = mean_weights @ moved
            P = (moved - x).T @ np.diag(cov_weights) @ (moved - x) + Q
        if np.isfinite(y[k, 0]):
            drawn = points()
            seen = np.sin(drawn[:, :1])
            expected = mean_weights @ seen
            S = (seen - expected).T @ np.diag(cov_weights) @ (seen - expected) + R
            K = (drawn - x).T @ np.diag(cov_weights) @ (seen - expected) / S
            x, P = x + K[:, 0] * (y[k] - expected)[0], P - K @ S @ K.T
        out.append(x)
    return np.array(out)


REFERENCES = {"ekf": numpy_ekf, "ukf": numpy_ukf}


def stay(x, u, t):
    """The same state."""
    return x


def walk(**changes: Any) -> gf.models.AbstractModel:
    """One number that wanders and is measured."""
    given = {"F": [[1.0]], "H": [[1.0]], "Q": 0.1, "R": 1.0, "states": {"x": "m"}, "outputs": {"y": "m"}} | changes
    return gf.linear_model(given.pop("F"), given.pop("H"), **given)


def broken_f(x, u, t, p):
    """Grows by a factor, and is NaN from a time on."""
    return jnp.where(t >= p["f"], jnp.nan, p["growth"] * x)


def broken_h(x, u, t, p):
    """NaN from a time on and beyond a wall, and without a derivative where x is 2."""
    return jnp.where((t >= p["h"]) | (x > p["wall"]), jnp.nan, x) + p["kink"] * jnp.sqrt(jnp.abs(x - 2.0))


def broken_Q(x, u, t, p):
    """A variance that changes at a time, and where x passes 1.5."""
    return jnp.where((t >= p["Q"]) | (x[0] > p["edge_Q"]), p["new_Q"], p["old_Q"])[None, None]


def broken_R(x, u, t, p):
    """Likewise."""
    return jnp.where((t >= p["R"]) | (x[0] > p["edge_R"]), p["new_R"], p["old_R"])[None, None]


NEVER = np.inf
SOUND = {
    "f": NEVER,
    "h": NEVER,
    "Q": NEVER,
    "R": NEVER,
    "edge_Q": NEVER,
    "edge_R": NEVER,
    "wall": NEVER,
    "growth": 1.0,
    "kink": 0.0,
    "old_Q": 0.1,
    "new_Q": 0.1,
    "old_R": 1.0,
    "new_R": 1.0,
}


def breakable(**changes: float) -> gf.models.AbstractModel:
    """A model that fails in a way of one's choice: one compiled program for all of them."""
    return gf.discrete_model(
        broken_f, broken_h, states={"x": "m"}, outputs={"y": "m"}, Q=broken_Q, R=broken_R, parameters=SOUND | changes
    )


def run_breakable(estimator: str = "ekf", mean: float = 1.0, y: Any = None, **changes: float) -> gf.Result:
    """A run of six rows along a breakable model."""
    model = breakable(**changes)
    log = gf.make_log(model, np.arange(6.0), np.ones(6) if y is None else y)
    return gf.run(ESTIMATORS[estimator], model, gf.make_prior(model, [mean], [1.0]), log)


def estimate(kind, model=None, prior=None, y=None, t=None, **options):
    """A run along the pendulum with something replaced."""
    model = pendulum() if model is None else model
    times, _, measured = swung()
    log = gf.make_log(model, times if t is None else t, measured if y is None else y)
    return gf.run(ESTIMATORS[kind], model, gf.make_prior(model, MEAN, STD) if prior is None else prior, log, **options)


def with_one(value):
    y = swung()[2].copy()
    y[100] = value
    return y
