"""Regression: parameters of linear equations, also where the regressors are as noisy as the rest."""

from .batch import (
    Fit,
    bias_compensated_least_squares,
    generalized_total_least_squares,
    least_squares,
    total_least_squares,
)
from .decoupled_training import DecoupledKalmanTraining
from .identifiability import Identifiability, identifiability
from .instruments import instrumental_variables, instrumented
from .kalman_training import KalmanTraining, network_weights_model
from .model import RegressionModel, readings, regression_model
from .pencil import Separation
from .rates import (
    CENTRAL_DIFFERENCE,
    differentiate,
    quadratic_rate,
    quadratic_rate_mean,
    rate_noise_covariance,
    rate_rows,
)
from .rayleigh import RayleighTotalLeastSquares
from .recursive_least_squares import RecursiveLeastSquares
from .recursive_total_least_squares import RecursiveTotalLeastSquares
from .row_noise import AbstractRowNoise, ConstantRowNoise, RateRowNoise
from .rows import accumulated_noise, average, count_rows, information, noise_from_differences, sensor_lag
from .uncertainty import (
    errors_in_variables_scores,
    generalized_covariance,
    least_squares_bias,
    sandwich_covariance,
    total_least_squares_covariance,
)
from .weak_form import weak_curvature_taps, weak_form, weak_rows, weak_taps
from .weight_filter import WeightFilter, WeightState, fit_weights, ridge_weights

__all__ = [
    "AbstractRowNoise",
    "CENTRAL_DIFFERENCE",
    "ConstantRowNoise",
    "DecoupledKalmanTraining",
    "Fit",
    "Identifiability",
    "KalmanTraining",
    "RateRowNoise",
    "RayleighTotalLeastSquares",
    "RecursiveLeastSquares",
    "RecursiveTotalLeastSquares",
    "RegressionModel",
    "Separation",
    "WeightFilter",
    "WeightState",
    "accumulated_noise",
    "average",
    "bias_compensated_least_squares",
    "count_rows",
    "differentiate",
    "errors_in_variables_scores",
    "fit_weights",
    "generalized_covariance",
    "generalized_total_least_squares",
    "identifiability",
    "information",
    "instrumental_variables",
    "instrumented",
    "least_squares",
    "least_squares_bias",
    "network_weights_model",
    "noise_from_differences",
    "quadratic_rate",
    "quadratic_rate_mean",
    "rate_noise_covariance",
    "rate_rows",
    "readings",
    "regression_model",
    "ridge_weights",
    "sandwich_covariance",
    "sensor_lag",
    "total_least_squares",
    "total_least_squares_covariance",
    "weak_curvature_taps",
    "weak_form",
    "weak_rows",
    "weak_taps",
]
