"""What recursive regressors share: reading the rows of a sample, and the report of a step."""

from __future__ import annotations

import math
from typing import Any

import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Bool, Float, Int

from ..errors import ConfigError
from ..estimates import AbstractEstimate, Gaussian
from ..estimates.base import Innovation
from ..filters import Info
from ..linalg import congruence, root_and_inverse, symmetrize
from ..models import AbstractModel, Sample
from .model import RegressionModel


def as_regression(model: AbstractModel, weights: tuple[float, ...] | None) -> RegressionModel:
    """The model as one of regression, with as many sensors as there are weights."""
    if not isinstance(model, RegressionModel):
        raise ConfigError(f"model: expected a regression_model, got {type(model).__name__}")
    if weights is not None and len(weights) != model.output.size:
        raise ConfigError(
            f"weights: expected {model.output.size}, one per sensor ({', '.join(model.output.names)}), got {len(weights)}"
        )
    return model


def check_arguments(weights: tuple[float, ...] | None, forgetting: float) -> None:
    """Raise unless all weights are above 0 and the forgetting factor is one."""
    for j, weight in enumerate(weights or ()):
        if not isinstance(weight, Tracer) and not (weight > 0 and math.isfinite(weight)):
            raise ConfigError(f"weights: expected numbers above 0, got {weight!r} for sensor {j}")
    if not isinstance(forgetting, Tracer) and not 0 < forgetting <= 1:
        raise ConfigError(f"forgetting: expected a number above 0 and at most 1, got {forgetting!r}")


def rows_of(model: RegressionModel, sample: Sample) -> tuple[Float[Array, "s p"], Bool[Array, " s"]]:
    """The rows `[h, z]` of a sample, zero where anything of them is missing, and which are whole."""
    rows = jnp.concatenate([model.regressors(sample.when), sample.y[:, None]], axis=1)
    whole = sample.seen & jnp.all(jnp.isfinite(rows), axis=1)
    return jnp.where(whole[:, None], rows, 0.0), whole


def weights_of(
    weights: tuple[float, ...] | None, model: RegressionModel, estimate: AbstractEstimate, sample: Sample
) -> Float[Array, " s"]:
    """The sensors' weights: those given, or the inverse variances of the model."""
    if weights is not None:
        return jnp.asarray(weights, estimate.mean.dtype)
    return 1.0 / jnp.diagonal(model.measurement_noise(estimate.mean, sample.when))


def reported(
    rows: Float[Array, "s p"],
    whole: Bool[Array, " s"],
    before: Gaussian,
    noise: Float[Array, " s"],
    after: Gaussian,
    memory: Any,
    status: Int[Array, ""],
) -> Info:
    """The report of a step, with residuals against the estimate before it.

    Args:
        rows: of the sample.
        whole: which of them count.
        before: the estimate before the step.
        noise: variance of each residual but for what is uncertain of the parameters.
        after: the estimate after the step.
        memory: what to report beside it.
        status: what became of the step.
    """
    regressors = rows[:, :-1]
    residual = jnp.where(whole, rows[:, -1] - regressors @ before.mean, 0.0)
    spread = congruence(regressors, before.cov) + jnp.diag(jnp.where(whole, noise, 1.0))
    spread = symmetrize(spread)
    lower, inverse, _ = root_and_inverse(spread)
    found = Innovation(residual, spread, lower, inverse, whole, jnp.all(jnp.diagonal(lower) > 0))
    weight = whole.astype(residual.dtype)
    return Info.of(after, memory, found, weight, status)
