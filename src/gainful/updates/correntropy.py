"""Measurements that lose all weight when far off."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..estimates import AbstractEstimate, Affine
from ..linalg import product, times_inverse
from .reweighted import AbstractReweighted, Residuals, check_iterations

LEAST = 1e-8
"""Weights do not fall below this, so that noises stay finite."""


class MaximumCorrentropy(AbstractReweighted):
    """Weights `exp(-v^2 / 2 s^2)` of measurement and prediction; the covariance as if all weights were 1.

    Attributes:
        bandwidth: `s`, in sigmas.
        iterations: how often the weights are found.

    Source: Chen, Liu, Zhao and Principe (2017), Automatica 76:70-77.
    Differs: weights are at least 1e-8; a fixed number of iterations, from the prediction.
    Reduces to: `Exact` as `bandwidth` goes to infinity.
    """

    bandwidth: float = 3.0
    iterations: int = eqx.field(static=True, default=5)

    def __check_init__(self) -> None:
        if isinstance(self.bandwidth, (int, float)) and not self.bandwidth > 0:
            raise ConfigError(f"bandwidth: expected a number of sigmas above 0, got {self.bandwidth!r}")
        check_iterations(self.iterations)

    def weigh(self, residuals: Residuals) -> tuple[Float[Array, " m"], Float[Array, " dof"]]:
        return self._kernel(residuals.measured), self._kernel(residuals.moved)

    def _kernel(self, v: Array) -> Array:
        return jnp.maximum(jnp.exp(-0.5 * (v / self.bandwidth) ** 2), LEAST)

    def added(self, carry: Array, prior: AbstractEstimate, process: Float[Array, "dof dof"]) -> None:
        return None  # weights of the prediction make the gain, but not the covariance

    def conclude(
        self, prior: AbstractEstimate, weighted: AbstractEstimate, affine: Affine, scaled: Affine, y: Array, seen: Array
    ) -> AbstractEstimate:
        _, innovation = weighted.condition(scaled, y, seen)
        gain = times_inverse(product(scaled.matrix, weighted.cov), innovation.inverse)
        return prior.condition(affine, y, seen, gain=gain)[0]
