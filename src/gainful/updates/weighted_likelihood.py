"""Measurements that count less the further they are from what was expected."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from .reweighted import AbstractReweighted, Residuals


class WeightedLikelihood(AbstractReweighted):
    """The likelihood to the power of a weight that the innovation decides; one pass, no iteration.

    ```
    w^2 = 1 / (1 + v_i^2 / c^2), the noise of a component is R / w^2;  v in units of R
    ```

    Attributes:
        scale: `c`, in sigmas of R; 3 suits single components, 4 a few together.
        joint: one weight for all components, from `sum v_i^2`.

    Source: Duran-Martin et al. (2024), Outlier-robust Kalman filtering through generalised Bayes, ICML.
    Differs: distances in units of R, never in those of the sensors; weights per component unless `joint`.
    Reduces to: `Exact` as `scale` goes to infinity.
    """

    scale: float = 3.0
    joint: bool = eqx.field(static=True, default=False)

    def __check_init__(self) -> None:
        if isinstance(self.scale, (int, float)) and not self.scale > 0:
            raise ConfigError(f"scale: expected a number of sigmas above 0, got {self.scale!r}")

    @property
    def iterations(self) -> int:
        """One: the prediction alone decides."""
        return 1

    def weigh(self, residuals: Residuals) -> tuple[Float[Array, " m"], None]:
        square = residuals.measured**2
        if self.joint:
            square = jnp.broadcast_to(jnp.sum(square), square.shape)
        return 1.0 / (1.0 + square / self.scale**2), None
