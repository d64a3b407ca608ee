"""Measurement noise with heavy tails, its size found with the state."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from .reweighted import AbstractReweighted, Residuals, check_iterations


class StudentT(AbstractReweighted):
    """Student-t measurement noise: the posterior of state and noise scale, approximated by independent factors.

    ```
    w_i = (nu + 1) / (nu + ((y - h)_i^2 + (H P+ H^T)_ii) / R_ii)
    ```

    Attributes:
        dof: degrees of freedom `nu` of the noise; fewer have heavier tails.
        iterations: how often state and scales take turns.
        joint: one scale for all components, for sensors that fail together: `(nu + m) / (nu + sum of all)`.

    Source: Agamennoni, Nieto and Nebot (2012), IEEE Trans. Signal Process. 60(10):5024-5037; Piche, Sarkka and Hartikainen
        (2012), IEEE MLSP.
    Reduces to: `Exact` as `dof` goes to infinity.
    """

    dof: float = 6.0
    iterations: int = eqx.field(static=True, default=5)
    joint: bool = eqx.field(static=True, default=False)

    def __check_init__(self) -> None:
        if isinstance(self.dof, (int, float)) and not self.dof > 0:
            raise ConfigError(f"dof: expected degrees of freedom above 0, got {self.dof!r}")
        check_iterations(self.iterations)

    def weigh(self, residuals: Residuals) -> tuple[Float[Array, " m"], None]:
        square = residuals.measured**2 + residuals.spread
        if self.joint:
            scale = (self.dof + residuals.count) / (self.dof + jnp.sum(square))
            return jnp.broadcast_to(scale, square.shape), None
        return (self.dof + 1.0) / (self.dof + square), None
