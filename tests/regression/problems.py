"""Yaw and surge of an underwater vehicle, driven so that every parameter shows: the regressions all tests here solve."""

import functools

import jax
import jax.numpy as jnp
import numpy as np

import gainful as gf
from gainful.estimates import Gaussian
from gainful.filters import AbstractEstimator, Info
from gainful.plants import fourier_excitation
from gainful.regression import RegressionModel, readings, regression_model

COSINES = (-0.01, 0.12, -0.21, 0.18, 0.65)  # rad/s
SINES = (-0.07, 0.53, -0.13, -0.37, -0.06)  # rad/s
PERIOD, DT = 20.0, 0.05  # s
YAW = np.array([80.0, 50.0, 100.0])  # kg m^2, N m s, N m s^2
NAMES = ("mass", "linear", "quadratic")


def motion(rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Rate and acceleration, row by row."""
    _, rate, acceleration = fourier_excitation(COSINES, SINES, PERIOD, DT * jnp.arange(rows))
    return np.asarray(rate), np.asarray(acceleration)


@functools.cache
def clean_rows(rows: int, theta: tuple[float, ...] = tuple(YAW)) -> np.ndarray:
    """Rows `[rdot, r, r|r|, tau]` without noise (T, 4)."""
    rate, acceleration = motion(rows)
    regressors = np.stack([acceleration, rate, rate * np.abs(rate)], axis=1)
    return np.concatenate([regressors, (regressors @ np.array(theta))[:, None]], axis=1)


def noisy_rows(
    rng: np.random.Generator, rows: int, variance: float, sensors: int = 2, runs: int | None = None
) -> np.ndarray:
    """Rows of sensors with independent noise of equal variance in every column (T, s, 4), or several runs of them."""
    lead = () if runs is None else (runs,)
    noise = rng.standard_normal((*lead, rows, sensors, 4))
    noise *= np.sqrt(variance)
    noise += clean_rows(rows)[:, None, :]
    return noise


def model_of(sensors: int, R: float = 1.0) -> RegressionModel:
    return regression_model(NAMES, tuple("ab"[:sensors]), R=R)


def vague(model: RegressionModel, std: float = 1e3) -> Gaussian:
    return gf.make_prior(model, [0.0, 0.0, 0.0], [std] * 3)


def log_of(model: RegressionModel, rows: np.ndarray) -> gf.Log:
    return gf.make_log(model, DT * np.arange(len(rows)), *readings(rows))


SCAN = jax.jit(gf.scan)


def followed(estimator: AbstractEstimator, rows: np.ndarray, R: float = 1.0, std: float = 1e3) -> tuple[object, Info]:
    """The memory after a record and the reports along it."""
    model = model_of(rows.shape[1], R)
    return SCAN(estimator, model, vague(model, std), gf.samples_of(log_of(model, rows), float))
