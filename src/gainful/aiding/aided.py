"""A correction put around a filter's update, and taken off again."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax

from ..filters import AbstractEstimator, KalmanFilter
from ..updates import Corrected


def aided_filter(estimator: KalmanFilter, update: Corrected) -> KalmanFilter:
    """The filter with a correction around its own update.

    Args:
        estimator: the filter.
        update: from `train_aiding`, or read from a file; its inner update gives way to the filter's.
    """
    return dataclasses.replace(estimator, update=dataclasses.replace(update, inner=estimator.update))


def unaided_filter(estimator: AbstractEstimator) -> AbstractEstimator:
    """The estimator with every corrected update replaced by the one within it.

    Args:
        estimator: with or without corrections.
    """

    def inner(part: Any) -> Any:
        return part.inner if isinstance(part, Corrected) else part

    return jax.tree.map(inner, estimator, is_leaf=lambda part: isinstance(part, Corrected))
