"""Estimators: anything that steps through a record."""

from .base import AbstractEstimator, Info
from .kalman import Carry, KalmanFilter
from .named import (
    cubature_kalman_filter,
    extended_kalman_filter,
    iterated_extended_kalman_filter,
    kalman_filter,
    unscented_kalman_filter,
)

__all__ = [
    "AbstractEstimator",
    "Carry",
    "Info",
    "KalmanFilter",
    "cubature_kalman_filter",
    "extended_kalman_filter",
    "iterated_extended_kalman_filter",
    "kalman_filter",
    "unscented_kalman_filter",
]
