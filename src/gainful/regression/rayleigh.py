"""Total least squares by line searches along the newest input."""

from __future__ import annotations

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator, Info
from ..linalg import congruence, product, root, symmetrize
from ..models import AbstractModel, Sample
from .base import as_regression, check_arguments
from .errors_in_variables import TotalLeastSquaresCarry, concluded, started, taken
from .pencil import inverse_of
from .row_noise import AbstractRowNoise, ConstantRowNoise

Direction = Literal["input", "gain"]
DIRECTIONS: tuple[Direction, ...] = ("input", "gain")


class RayleighTotalLeastSquares(AbstractEstimator):
    """Total least squares by one exact line search per row, along its regressors or along the gain of least squares.

    ```
    J(theta) = a^T S a / a^T N a,   a = [theta; -1];    theta <- theta + alpha d,   d = h  or  S_hh^-1 h
    A alpha^2 + B alpha + C = 0 with A = N2 D1 - N1 D2, B = N2 D0 - N0 D2, C = N1 D0 - N0 D1
    ```

    where `N_j` and `D_j` are the products of `a` and `[d; 0]` with `S` and with `N`. At first `J` is nearly flat or least at
    infinity, so that the search starts from least squares after some rows.

    Attributes:
        weights: per sensor, inverse to its noise; by default the inverse variances of the model's regressands.
        forgetting: how much a row counts one step later.
        noise: covariance of the noise of a row of weight 1.
        direction: "input" as published, or "gain", which converges faster where regressors are alike.
        warm_start: rows of least squares before the first search.
        gap_gate: accept an estimate only if the eigenvalue gap exceeds what noise alone would show.

    Source: Feng, Zhang, Chang and Zheng (2004), IEEE Trans. Signal Process. 52(10):2729-2737; Davila (1994), 42(2):268-280.
    Differs: generic regressors, so no fast gain vector; any row covariance; a warm start.
    Reduces to: `RecursiveTotalLeastSquares` once both have converged.

    Example:
        >>> RayleighTotalLeastSquares(direction="gain").warm_start
        100
    """

    weights: tuple[float, ...] | None = None
    forgetting: float = 1.0
    noise: AbstractRowNoise = ConstantRowNoise()
    direction: Direction = eqx.field(static=True, default="input")
    warm_start: int = eqx.field(static=True, default=100)
    gap_gate: bool = eqx.field(static=True, default=True)

    def __check_init__(self) -> None:
        check_arguments(self.weights, self.forgetting)
        if self.direction not in DIRECTIONS:
            raise ConfigError(
                f"direction: {self.direction!r} is not known; {did_you_mean(str(self.direction), DIRECTIONS)}"
            )
        if not isinstance(self.warm_start, int) or self.warm_start < 0:
            raise ConfigError(f"warm_start: expected a whole number of at least 0, got {self.warm_start!r}")

    def init(self, model: AbstractModel, prior: AbstractEstimate) -> TotalLeastSquaresCarry:
        as_regression(model, self.weights)
        a = jnp.append(prior.mean, -jnp.ones((), prior.mean.dtype))
        return started(model, prior, jnp.zeros((len(a), len(a)), a.dtype), a)

    def step(
        self, model: AbstractModel, carry: TotalLeastSquaresCarry, sample: Sample
    ) -> tuple[TotalLeastSquaresCarry, Info]:
        new = taken(model, carry, sample, self.weights, self.forgetting, self.noise)
        counted = jnp.where(new.whole, new.weights, 0.0)
        information = self.forgetting * carry.square + symmetrize(product(new.rows.T * counted, new.rows))
        n = len(carry.direction) - 1
        inverse = inverse_of(root(information[:n, :n])[0])
        least = inverse.T @ (inverse @ information[:n, n])
        theta = carry.direction[:n]
        for row in new.rows:
            along = row[:n] if self.direction == "input" else inverse.T @ (inverse @ row[:n])
            theta = theta + line_search(theta, along, information, new.noise) * along
        theta = jnp.where(new.count <= self.warm_start, least, theta)
        direction = jnp.append(theta, -jnp.ones((), theta.dtype))
        half = inverse_of(root(information)[0])
        spectrum = jnp.linalg.eigvalsh(symmetrize(congruence(half, new.noise)))
        return concluded(carry, information, direction, information, spectrum, new, gate=self.gap_gate)


def line_search(
    theta: Float[Array, " n"], along: Float[Array, " n"], information: Float[Array, "p p"], noise: Float[Array, "p p"]
) -> Float[Array, ""]:
    """The step along a direction to the least Rayleigh quotient `a^T S a / a^T N a`, 0 where there is none."""
    a = jnp.append(theta, -jnp.ones((), theta.dtype))
    d = jnp.append(along, jnp.zeros((), theta.dtype))
    above, below = ((a @ (m @ a), d @ (m @ a), d @ (m @ d)) for m in (information, noise))
    (n0, n1, n2), (d0, d1, d2) = above, below
    second, first, constant = n2 * d1 - n1 * d2, n2 * d0 - n0 * d2, n1 * d0 - n0 * d1
    spread = jnp.sqrt(jnp.maximum(first**2 - 4.0 * second * constant, 0.0))
    # The root at which the quotient is least, written without cancellation.
    near = first >= 0
    lower = jnp.where(near, first + spread, 1.0)
    double = jnp.where(near | (second == 0), 1.0, 2.0 * second)
    alpha = jnp.where(near, -2.0 * constant / jnp.where(lower == 0, 1.0, lower), (spread - first) / double)
    flat = jnp.where(near, lower == 0, second == 0)
    return jnp.where(flat | ~jnp.isfinite(alpha), 0.0, alpha)
