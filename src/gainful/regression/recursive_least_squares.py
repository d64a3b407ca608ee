"""Recursive least squares."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from ..estimates import AbstractEstimate, Affine, Gaussian
from ..filters import AbstractEstimator, Info
from ..filters.base import is_finite, step_status
from ..models import AbstractModel, Sample
from .base import as_regression, check_arguments, rows_of, weights_of


class RecursiveLeastSquares(AbstractEstimator):
    """Least squares that takes one row per sensor and step, and may forget old ones.

    ```
    K = P H^T (lam W^-1 + H P H^T)^-1,   theta <- theta + K (z - H theta),   P <- (P - K H P) / lam
    ```

    Biased towards zero where the regressors are noisy, however long the record: see `RecursiveTotalLeastSquares`.

    Attributes:
        weights: per sensor; by default the inverse variances of the model's regressands.
        forgetting: `lam`, how much a row counts one step later; steps without a measurement forget nothing.
        estimate: the coordinates of the estimate, `Gaussian` or `SquareRoot`.

    Source: Plackett (1950), Biometrika 37(1-2):149-157.
    Reduces to: the Kalman filter of the same model without forgetting; batch least squares for a vague prior.

    Example:
        >>> RecursiveLeastSquares(forgetting=0.99).estimate.__name__
        'Gaussian'
    """

    weights: tuple[float, ...] | None = None
    forgetting: float = 1.0
    estimate: type[AbstractEstimate] = eqx.field(static=True, default=Gaussian)

    def __check_init__(self) -> None:
        check_arguments(self.weights, self.forgetting)

    def init(self, model: AbstractModel, prior: AbstractEstimate) -> AbstractEstimate:
        as_regression(model, self.weights)
        return self.estimate.start(prior.mean, prior.cov, model.space)

    def step(self, model: AbstractModel, carry: AbstractEstimate, sample: Sample) -> tuple[AbstractEstimate, Info]:
        regression = as_regression(model, self.weights)
        rows, whole = rows_of(regression, sample)
        measured = jnp.any(whole)
        moved = carry.plus_noise(regression.process_noise(carry.mean, sample.when))
        moved = jax.tree.map(lambda new, old: jnp.where(sample.when.dt > 0, new, old), moved, carry)
        faded = moved.plus_noise((1.0 / self.forgetting - 1.0) * moved.cov)
        if self.weights is None:
            noise = regression.measurement_noise(carry.mean, sample.when)
        else:
            noise = jnp.diag(1.0 / weights_of(self.weights, regression, carry, sample))
        regressors, none = rows[:, :-1], jnp.zeros((len(rows), 0), rows.dtype)
        value = regressors @ faded.mean
        affine = Affine(value, regressors, faded.mean, noise, none, none, regression.space, regression.output)
        posterior, innovation = faded.condition(affine.masked(whole), rows[:, -1], whole)
        usable = innovation.positive & is_finite(posterior)
        after = jax.tree.map(lambda new, old: jnp.where(measured & usable, new, old), posterior, moved)
        status = step_status(measured, innovation, usable, measured)
        return after, Info.of(after, (), innovation, whole.astype(value.dtype), status)
