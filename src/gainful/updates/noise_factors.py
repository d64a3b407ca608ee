"""Factors by which the measurement noise is larger than the model says, kept within bounds and given up where they run away."""

from __future__ import annotations

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..errors import ConfigError
from ..linalg import congruence
from .base import Update


class Factors(eqx.Module):
    """Learned factors on the variances of the measurement noise.

    Attributes:
        value: of each component, within its bounds (m,).
        high: measurements in a row for which it would have been above the ceiling (m,).
        lost: whether it was given up, so that the model's own noise counts again (m,).
    """

    value: Float[Array, " m"]
    high: Int[Array, " m"]
    lost: Bool[Array, " m"]

    @classmethod
    def start(cls, m: int) -> Factors:
        """The model's own noise."""
        return cls(jnp.ones(m), jnp.zeros(m, jnp.int32), jnp.zeros(m, bool))

    @property
    def used(self) -> Float[Array, " m"]:
        """Factors to apply: 1 for components given up (m,)."""
        return jnp.where(self.lost, 1.0, self.value)

    def moved(
        self, raw: Float[Array, " m"], taught: Bool[Array, " m"], floor: float, ceiling: float, patience: int
    ) -> Factors:
        """The factors after a measurement that asks for `raw` where it teaches anything."""
        high = jnp.where(raw > ceiling, self.high + 1, 0)
        lost = self.lost | (high >= patience)
        new = Factors(jnp.clip(raw, floor, ceiling), high, lost)
        return Factors(
            jnp.where(taught, new.value, self.value).astype(self.value.dtype),
            jnp.where(taught, new.high, self.high).astype(self.high.dtype),
            jnp.where(taught, new.lost, self.lost),
        )


def multiplied(noise: Float[Array, "m m"], factors: Float[Array, " m"]) -> Float[Array, "m m"]:
    """The covariance with its variances multiplied and its correlations kept."""
    scale = jnp.sqrt(factors).astype(noise.dtype)
    return scale[:, None] * noise * scale[None, :]


def unexplained(update: Update, used: Float[Array, " m"]) -> Float[Array, " m"]:
    """Squared innovations less what the prior explains, in units of the model's own variances; 1 on average if these hold.

    Args:
        update: what a measurement did.
        used: factors on the model's variances that were in force.
    """
    affine = update.affine
    spread = jnp.diagonal(congruence(affine.matrix, update.prior.cov) + affine.covariance() - affine.noise)
    own = jnp.diagonal(affine.noise) / used
    return (update.innovation.residual**2 - spread) / jnp.where(own > 0, own, jnp.inf)


def check_limits(floor: float, ceiling: float, patience: int) -> None:
    """Raise unless factors can stay between the bounds."""
    if isinstance(floor, (int, float)) and not 0 < floor <= 1:
        raise ConfigError(f"floor: expected a factor above 0 and at most 1, got {floor!r}")
    if isinstance(ceiling, (int, float)) and not (ceiling >= 1 and not math.isnan(ceiling)):
        raise ConfigError(f"ceiling: expected a factor of at least 1, got {ceiling!r}")
    if isinstance(patience, bool) or not isinstance(patience, int) or patience < 1:
        raise ConfigError(f"patience: expected a whole number of at least 1, got {patience!r}")


def check_memory(memory: float) -> None:
    """Raise unless the past can be remembered by this factor."""
    if isinstance(memory, (int, float)) and not 0 < memory <= 1:
        raise ConfigError(f"memory: expected a number above 0 and at most 1, got {memory!r}")
