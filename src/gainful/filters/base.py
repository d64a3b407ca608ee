"""The contract of an estimator."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float, Int

from ..estimates import AbstractEstimate
from ..models import AbstractModel, Sample


class Info(eqx.Module):
    """What one step reports.

    Attributes:
        estimate: the estimate after the step.
        memory: what the estimator's parts remember after the step.
        residual: measured minus expected, 0 where unseen (m,).
        residual_cov: covariance of the residual, unit where unseen (m, m).
        nis: normalised innovation squared.
        log_likelihood: log density of the measurement.
        weight: how far each component counted (m,).
        status: a `Status` code.
    """

    estimate: AbstractEstimate
    memory: Any
    residual: Float[Array, " m"]
    residual_cov: Float[Array, "m m"]
    nis: Float[Array, ""]
    log_likelihood: Float[Array, ""]
    weight: Float[Array, " m"]
    status: Int[Array, ""]


class AbstractEstimator(eqx.Module):
    """Anything that steps through a record: filters, banks, recursive regressors."""

    @abc.abstractmethod
    def init(self, model: AbstractModel, prior: AbstractEstimate) -> Any:
        """The memory before the first sample."""

    @abc.abstractmethod
    def step(self, model: AbstractModel, carry: Any, sample: Sample) -> tuple[Any, Info]:
        """One sample: the memory after it and a report."""
