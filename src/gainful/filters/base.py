"""The contract of an estimator."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..errors import Status
from ..estimates import AbstractEstimate, Innovation
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

    @classmethod
    def of(
        cls,
        estimate: AbstractEstimate,
        memory: Any,
        innovation: Innovation,
        weight: Float[Array, " m"],
        status: Int[Array, ""],
    ) -> Info:
        """The report of a step with that innovation."""
        return cls(
            estimate,
            memory,
            innovation.residual,
            innovation.cov,
            innovation.nis,
            innovation.log_likelihood,
            weight,
            status,
        )


def is_finite(tree: Any) -> Bool[Array, ""]:
    """Whether all numbers of a tree are."""
    return jnp.all(jnp.isfinite(jnp.concatenate([jnp.ravel(leaf) for leaf in jax.tree.leaves(tree)])))


def step_status(
    measured: Bool[Array, ""], innovation: Innovation, usable: Bool[Array, ""], counted: Bool[Array, ""]
) -> Int[Array, ""]:
    """What became of a step whose prediction is sound.

    Args:
        measured: whether there was a measurement.
        innovation: of the update.
        usable: whether what the update made of it can be kept.
        counted: whether any of the measurement counted.
    """
    judged = jnp.where(usable, jnp.where(counted, Status.ok, Status.rejected), Status.nonfinite)
    broken = ~innovation.positive & is_finite(innovation.cov)
    return jnp.where(measured, jnp.where(broken, Status.not_positive, judged), Status.missing).astype(jnp.int32)


class AbstractEstimator(eqx.Module):
    """Anything that steps through a record: filters, banks, recursive regressors."""

    @abc.abstractmethod
    def init(self, model: AbstractModel, prior: AbstractEstimate) -> Any:
        """The memory before the first sample."""

    @abc.abstractmethod
    def step(self, model: AbstractModel, carry: Any, sample: Sample) -> tuple[Any, Info]:
        """One sample: the memory after it and a report."""
