"""Regression: what is given wrong is said with its name, what was expected and what came."""

import numpy as np
import pytest

import gainful as gf
from gainful import regression as rg
from gainful.errors import ConfigError, CovarianceError, DataError, ModelError, ShapeError
from gainful.plants import fourier_excitation
from gainful.regression.rates import check_stencil

ROWS = np.random.default_rng(0).standard_normal((20, 2, 4))
SIGNAL = np.sin(np.arange(40.0))


def started(estimator, model=None):
    model = rg.regression_model(3, ("a", "b")) if model is None else model
    return estimator.init(model, gf.make_prior(model, np.zeros(model.space.size), np.ones(model.space.size)))


MODELS = [
    (
        lambda: rg.regression_model({"x": "angle"}),
        ModelError,
        "parameters: expected plain numbers with units, got angles, quaternions or bounds",
    ),
    (lambda: rg.regression_model(2, "ab"), ModelError, "sensors: expected at least one name, each once, got 'ab'"),
    (
        lambda: rg.regression_model(2, ("a", "a")),
        ModelError,
        "sensors: expected at least one name, each once, got ('a'",
    ),
    (lambda: rg.regression_model(2, columns=["h"]), ModelError, "columns: expected 2, one per parameter, got ['h']"),
    (lambda: rg.regression_model(["z"]), ModelError, "sensors: 'z' is already the name of a parameter or an input"),
    (lambda: rg.regression_model(2, R=[1.0, 2.0]), ShapeError, "R: expected shape (1, 1), got (2, 2)"),
    (lambda: rg.regression_model(2, Q=[1.0, -2.0]), CovarianceError, "Q: expected variances of at least 0, got -2"),
    (
        lambda: rg.readings(ROWS[:, 0]),
        ShapeError,
        "rows: expected shape (times, sensors, columns and regressand), got (20, 4)",
    ),
]

ESTIMATORS = [
    (
        lambda: started(rg.RecursiveLeastSquares(), gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)),
        ConfigError,
        "model: expected a regression_model, got Model",
    ),
    (
        lambda: started(rg.RecursiveTotalLeastSquares(weights=(1.0,))),
        ConfigError,
        "weights: expected 2, one per sensor (a, b), got 1",
    ),
    (
        lambda: rg.RecursiveLeastSquares(weights=(1.0, 0.0)),
        ConfigError,
        "weights: expected numbers above 0, got 0.0 for sensor 1",
    ),
    (
        lambda: rg.RecursiveLeastSquares(forgetting=1.1),
        ConfigError,
        "forgetting: expected a number above 0 and at most 1, got 1.1",
    ),
    (
        lambda: rg.RecursiveTotalLeastSquares(form="qrr"),  # type: ignore[arg-type]
        ConfigError,
        "form: 'qrr' is not known; did you mean 'qr'?",
    ),
    (
        lambda: rg.RecursiveTotalLeastSquares(iterations=0),
        ConfigError,
        "iterations: expected a whole number of at least 1, got 0",
    ),
    (lambda: rg.RecursiveTotalLeastSquares(loading=0), ConfigError, "loading: expected a number above 0, got 0"),
    (
        lambda: rg.RayleighTotalLeastSquares(direction="gian"),  # type: ignore[arg-type]
        ConfigError,
        "direction: 'gian' is not known; did you mean 'gain'?",
    ),
    (
        lambda: rg.RayleighTotalLeastSquares(warm_start=-1),
        ConfigError,
        "warm_start: expected a whole number of at least 0, got -1",
    ),
]

NOISES = [
    (
        lambda: rg.ConstantRowNoise(((1.0, 0.0),)),
        ConfigError,
        "covariance: expected a number, variances or a square matrix, got shape (1, 2)",
    ),
    (
        lambda: rg.ConstantRowNoise((1.0, -1.0)),
        CovarianceError,
        "covariance: expected variances of at least 0, got -1 for 'column 1'",
    ),
    (lambda: rg.ConstantRowNoise(0.0), ConfigError, "covariance: expected noise in at least one column, got none"),
    (
        lambda: started(rg.RecursiveTotalLeastSquares(noise=rg.ConstantRowNoise((1.0, 1.0)))),
        ConfigError,
        "covariance: expected 4 columns as in a row, got 2",
    ),
    (lambda: rg.RateRowNoise(rate=0.0), ConfigError, "rate: expected a number above 0, got 0.0"),
    (
        lambda: rg.RateRowNoise()(np.ones(3)),
        ConfigError,
        "RateRowNoise: expected rows of a rate's derivative, rate, square and wrench, got 3",
    ),
    (
        lambda: rg.noise_from_differences(ROWS, ROWS),
        ShapeError,
        "first: expected shape (times, columns), got (20, 2, 4)",
    ),
    (
        lambda: rg.noise_from_differences(ROWS[:1, 0], ROWS[:1, 1]),
        DataError,
        "first: expected at least two rows whole in both sensors, got 1",
    ),
    (
        lambda: rg.noise_from_differences(ROWS[:, 0], ROWS[:, 0]),
        DataError,
        "second: expected a sensor of its own, got the same rows as those of the first",
    ),
]

SIGNALS = [
    (
        lambda: check_stencil([1.0, -1.0]),
        ConfigError,
        "stencil: expected an odd number of coefficients, at least 3, got 2",
    ),
    (
        lambda: rg.differentiate(SIGNAL, 0.1, [-1.0, 0.0, 1.0]),
        ConfigError,
        "stencil: expected coefficients that differentiate a ramp exactly, got [-1.0, 0.0, 1.0]",
    ),
    (lambda: rg.differentiate(SIGNAL[:4], 0.1), ShapeError, "signal: expected at least 5 samples, got 4"),
    (
        lambda: rg.weak_form(SIGNAL, 0.1, 4),
        ConfigError,
        "window: expected an odd number of samples of at least 3, got 4",
    ),
    (lambda: rg.weak_taps(5, 0.0), ConfigError, "dt: expected a time above 0 s, got 0.0"),
    (
        lambda: rg.sensor_lag(SIGNAL, SIGNAL[:-1], 0.1, 0.2),
        ShapeError,
        "second: expected shape (40,), as the first signal, got (39,)",
    ),
    (
        lambda: rg.sensor_lag(SIGNAL, SIGNAL, 0.1, 2.0),
        DataError,
        "first: expected more than 42 samples for a limit of 2 s, got 40",
    ),
    (
        lambda: rg.sensor_lag(SIGNAL, 0 * SIGNAL, 0.1, 0.2),
        DataError,
        "first: expected signals that move, got a constant",
    ),
    (
        lambda: rg.information(ROWS[:, 0]),
        ShapeError,
        "rows: expected shape (..., times, sensors, columns and regressand), got (20, 4)",
    ),
    (
        lambda: rg.average(ROWS, [1.0]),
        ShapeError,
        "weights: expected 2, one per sensor, got shape (1,)",
    ),
    (
        lambda: rg.sandwich_covariance(ROWS[:, 0], np.eye(4), lag=-1),
        ConfigError,
        "lag: expected a whole number of rows of at least 0, got -1",
    ),
    (lambda: rg.identifiability(ROWS, np.eye(3)), ShapeError, "noise: expected shape (4, 4), got (3, 3)"),
    (lambda: rg.identifiability(ROWS, 1.0, columns=["r"]), ShapeError, "columns: expected 3 names, got 1"),
    (
        lambda: fourier_excitation([0.1, 0.2], [0.1], 20.0, np.zeros(1)),
        ConfigError,
        "b: expected as many amplitudes as a has, (2,), got (1,)",
    ),
]


@pytest.mark.parametrize(("attempt", "error", "message"), [*MODELS, *ESTIMATORS, *NOISES, *SIGNALS])
def test_a_message_of_regression_names_the_argument_what_was_expected_and_what_came(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)
