"""Regressors that come from one measured rate: its derivative, itself, its square with sign, and how noisy they are."""

from __future__ import annotations

import math
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jax.scipy.special import erf
from jaxtyping import Array, Float

from ..errors import ConfigError, ShapeError

CENTRAL_DIFFERENCE = (1 / 12, -8 / 12, 0.0, 8 / 12, -1 / 12)
"""The five-point stencil: `rdot = sum_j c_j r(k + j) / dt` for j = -2..2, exact for polynomials of degree 4."""


def check_stencil(stencil: Sequence[float]) -> None:
    """Raise unless a stencil has a middle and is exact for ramps."""
    c = np.asarray(stencil, dtype=float)
    if c.ndim != 1 or len(c) % 2 == 0 or len(c) < 3:
        raise ConfigError(f"stencil: expected an odd number of coefficients, at least 3, got {len(stencil)}")
    j = np.arange(len(c)) - len(c) // 2
    if abs(c.sum()) > 1e-9 or abs(c @ j - 1) > 1e-9:
        raise ConfigError(f"stencil: expected coefficients that differentiate a ramp exactly, got {list(stencil)}")


def rate_noise_covariance(
    rate: Float[Array, "*batch"],
    rate_std: float | Array,
    wrench_std: float | Array,
    dt: float | Array,
    stencil: Sequence[float] = CENTRAL_DIFFERENCE,
) -> Float[Array, "*batch 4 4"]:
    """Covariance of the row `[rdot, r, r|r|, tau]` whose first three columns come from one noisy rate.

    ```
    var(rdot) = s^2 sum_j c_j^2 / dt^2     cov(rdot, r) = c_0 s^2 / dt     var(r) = s^2       var(tau) = s_tau^2
    var(r|r|) = max(4 r^2 s^2 - 2 s^4, 0)  cov(r, r|r|) = 2 |r| s^2        cov(rdot, r|r|) = 2 |r| c_0 s^2 / dt
    ```

    `r` is the noisy rate, whose square exceeds the true one's by `s^2` on average: the variance of `r|r|` is therefore
    `4 r^2 s^2 + 2 s^4` for the true rate and `4 r^2 s^2 - 2 s^4` for the measured one. Being right on average over rows,
    the matrix of a single row need not be positive semi-definite.

    Args:
        rate: measured.
        rate_std: standard deviation of the rate, in its unit; of the mean of k equal sensors that of one over sqrt(k).
        wrench_std: standard deviation of the wrench, in its unit.
        dt: time between samples [s].
        stencil: with which the rate was differentiated.

    Source: Fuller (1987), Measurement Error Models, section 3.1, for functions of a normal variable.
    """
    r, c = jnp.asarray(rate), np.asarray(stencil, dtype=float)
    middle, squares = float(c[len(c) // 2]), float(c @ c)
    s2 = rate_std**2
    one, zero, slope = jnp.ones_like(r), jnp.zeros_like(r), 2.0 * jnp.abs(r)
    entries = [
        [squares * s2 / dt**2 * one, middle * s2 / dt * one, slope * middle * s2 / dt, zero],
        [middle * s2 / dt * one, s2 * one, slope * s2, zero],
        [slope * middle * s2 / dt, slope * s2, jnp.maximum(4.0 * r**2 * s2 - 2.0 * s2**2, 0.0), zero],
        [zero, zero, zero, wrench_std**2 * one],
    ]
    return jnp.stack([jnp.stack(row, axis=-1) for row in entries], axis=-2)


def quadratic_rate_mean(rate: Float[Array, "*batch"], std: float | Array) -> Float[Array, "*batch"]:
    """`E (r + e)|r + e|` for normal `e`: what a noisy rate makes of its square with sign, `r|r|` and about `s^2 sgn r`.

    Args:
        rate: true.
        std: standard deviation of its noise, above 0.

    Example:
        >>> round(float(quadratic_rate_mean(0.5, 0.1)), 9)
        0.26
    """
    r, s = jnp.asarray(rate), jnp.asarray(std)
    x = r / s
    odds = erf(x / math.sqrt(2.0))  # 2 Phi(x) - 1
    return (r**2 + s**2) * odds + 2.0 * r * s * jnp.exp(-0.5 * x**2) / math.sqrt(2.0 * math.pi)


def quadratic_rate(rate: Float[Array, "*batch"], std: float | Array | None = None) -> Float[Array, "*batch"]:
    """`r|r|` of a measured rate, less what its noise adds on average: `2 r|r| - E (r + e)|r + e|`, correct to first order.

    Args:
        rate: measured.
        std: standard deviation of its noise; without it nothing is taken away.

    Example:
        >>> round(float(quadratic_rate(0.5, 0.1)), 6)
        0.24
    """
    r = jnp.asarray(rate)
    square = r * jnp.abs(r)
    return square if std is None else 2.0 * square - quadratic_rate_mean(r, std)


def differentiate(
    signal: Float[Array, "*batch T"], dt: float, stencil: Sequence[float] = CENTRAL_DIFFERENCE
) -> Float[Array, "*batch T_inner"]:
    """The derivative along the last axis, at all samples but half a stencil at either end.

    Raises:
        ConfigError: a stencil that does not differentiate a ramp exactly.
        ShapeError: fewer samples than coefficients.

    Example:
        >>> import jax.numpy as jnp
        >>> differentiate(jnp.arange(6.0) ** 2, 1.0).round(9).tolist()
        [4.0, 6.0]
    """
    check_stencil(stencil)
    return filtered(jnp.asarray(signal), np.asarray(stencil) / dt)


def filtered(signal: Float[Array, "*batch T"], taps: Sequence[float] | np.ndarray) -> Float[Array, "*batch T_inner"]:
    """`sum_j c_j x(k + j)` along the last axis wherever all of it is there."""
    width, length = len(taps), signal.shape[-1]
    if length < width:
        raise ShapeError(f"signal: expected at least {width} samples, got {length}")
    inner = length - width + 1
    return sum((tap * signal[..., j : j + inner] for j, tap in enumerate(taps)), jnp.zeros(()))


def rate_rows(
    rate: Float[Array, "*batch T"],
    wrench: Float[Array, "*batch T"],
    dt: float,
    *,
    std: float | Array | None = None,
    stencil: Sequence[float] = CENTRAL_DIFFERENCE,
) -> Float[Array, "*batch T_inner 4"]:
    """Rows `[rdot, r, r|r|, tau]` of a rate differentiated by a stencil.

    Args:
        rate: measured, along the last axis.
        wrench: force or moment at the same times.
        dt: time between samples [s].
        std: standard deviation of the rate's noise, to take its mean out of `r|r|`.
        stencil: of the derivative.
    """
    half = len(stencil) // 2
    middle, force = rate[..., half : rate.shape[-1] - half], wrench[..., half : wrench.shape[-1] - half]
    columns = (differentiate(rate, dt, stencil), middle, quadratic_rate(middle, std), force)
    return jnp.stack(jnp.broadcast_arrays(*columns), axis=-1)
