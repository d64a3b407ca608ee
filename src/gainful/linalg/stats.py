"""Densities and quantiles."""

from __future__ import annotations

import math

import jax.numpy as jnp
import numpy as np
import scipy.special
from jaxtyping import Array, Float, Int


def gaussian_log_density(
    whitened: Float[Array, " m"], lower: Float[Array, "m m"], count: Int[Array, ""]
) -> Float[Array, ""]:
    """Log density of a residual given its whitened form `w = L^-1 r`, the root `L` of its covariance and its degrees.

    Masked components carry `w = 0` and a unit pivot, so they add nothing; `count` leaves them out of the constant.
    """
    pivots = jnp.diagonal(lower)
    log_determinant = 2.0 * jnp.sum(jnp.log(jnp.where(pivots > 0, pivots, 1.0)))
    return -0.5 * (jnp.sum(whitened**2) + log_determinant + count * math.log(2.0 * math.pi))


def chi_square_quantile(probability: float, degrees: int) -> np.ndarray:
    """Chi-square quantiles at `probability` for 0, 1, ..., `degrees` degrees of freedom (0 for none)."""
    return np.concatenate([[0.0], scipy.special.chdtri(np.arange(1, degrees + 1), 1.0 - probability)])
