"""Estimators: anything that steps through a record."""

from .bank import InteractingMultipleModel
from .base import AbstractEstimator, Info
from .jump_bank import GeneralizedLikelihoodRatio, JumpReport
from .kalman import Carry, KalmanFilter
from .named import (
    adaptive_two_stage_unscented_kalman_filter,
    cubature_kalman_filter,
    extended_kalman_filter,
    huber_kalman_filter,
    iterated_extended_kalman_filter,
    kalman_filter,
    maximum_correntropy_kalman_filter,
    robust_extended_kalman_filter,
    robust_unscented_kalman_filter,
    student_t_kalman_filter,
    two_stage_extended_kalman_filter,
    two_stage_kalman_filter,
    two_stage_unscented_kalman_filter,
    unscented_kalman_filter,
    weighted_likelihood_kalman_filter,
)

__all__ = [
    "AbstractEstimator",
    "Carry",
    "GeneralizedLikelihoodRatio",
    "Info",
    "InteractingMultipleModel",
    "JumpReport",
    "KalmanFilter",
    "adaptive_two_stage_unscented_kalman_filter",
    "cubature_kalman_filter",
    "extended_kalman_filter",
    "huber_kalman_filter",
    "iterated_extended_kalman_filter",
    "kalman_filter",
    "maximum_correntropy_kalman_filter",
    "robust_extended_kalman_filter",
    "robust_unscented_kalman_filter",
    "student_t_kalman_filter",
    "two_stage_extended_kalman_filter",
    "two_stage_kalman_filter",
    "two_stage_unscented_kalman_filter",
    "unscented_kalman_filter",
    "weighted_likelihood_kalman_filter",
]
