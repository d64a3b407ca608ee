"""A vehicle's yaw with two gyros and one torque: what the tests here find parameters in."""

import functools

import numpy as np

from gainful.identification import Recording, parse_equation
from gainful.plants import fourier_excitation

DT, PERIOD = 0.05, 8.0  # s
COSINES = (-0.005, 0.06, -0.105, 0.09, 0.325)  # rad/s
SINES = (-0.035, 0.265, -0.065, -0.185, -0.03)  # rad/s
THETA = np.array([0.28, 0.07, 1.55])  # kg m^2, N m s, N m s^2
SIGNALS = ("r", "tau")
TERMS = {"mass": "d(r)", "linear": "r", "quadratic": "r*abs(r)"}
ROWS = 1600


def equation(**options):
    return parse_equation("tau", TERMS, SIGNALS, **options)


@functools.cache
def motion() -> tuple[np.ndarray, np.ndarray]:
    """Rate and torque without noise."""
    _, rate, acceleration = map(np.asarray, fourier_excitation(COSINES, SINES, PERIOD, DT * np.arange(ROWS)))
    return rate, np.stack([acceleration, rate, rate * np.abs(rate)], axis=1) @ THETA


def recording(rng: np.random.Generator, rate: float, torque: float, sensors: int = 2, **options) -> Recording:
    clean, wrench = motion()
    measured = clean[:, None] + rate * rng.standard_normal((ROWS, sensors))
    return Recording(
        DT * np.arange(ROWS), {"r": measured, "tau": wrench + torque * rng.standard_normal(ROWS)}, **options
    )
