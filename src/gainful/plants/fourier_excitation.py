"""A motion that starts and ends at rest and shows a plant's parameters in between."""

from __future__ import annotations

import math
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError


def fourier_excitation(
    a: Any, b: Any, period: float | Array, t: Float[Array, "*times"]
) -> tuple[Float[Array, "*times"], Float[Array, "*times"], Float[Array, "*times"]]:
    """A modified Fourier series: position, rate and acceleration at some times.

    ```
    rate = sum_l a_l cos(l w t) + b_l sin(l w t) + p'(t / T) / T,   w = 2 pi / T
    ```

    with the polynomial `p` of degree 5 for which position, rate and acceleration vanish at the start and end of the period;
    repeated from there on.

    Args:
        a: amplitudes of the cosines, in the rate's unit.
        b: amplitudes of the sines, as many.
        period: `T` [s].
        t: times [s].

    Raises:
        ConfigError: amplitudes that are not as many, or none.

    Source: Wu, Wang, You and Xiang (2013), J. Zhejiang Univ. (Eng. Sci.) 47; Swevers et al. (1997), IEEE Trans. Robot. Autom.
        13(5):730-740.

    Example:
        >>> q, rate, acceleration = fourier_excitation([0.1], [0.2], 20.0, jnp.array([0.0, 20.0]))
        >>> bool(jnp.allclose(jnp.stack([q, rate, acceleration]), 0.0, atol=1e-12))
        True
    """
    cosines, sines = jnp.atleast_1d(jnp.asarray(a, dtype=float)), jnp.atleast_1d(jnp.asarray(b, dtype=float))
    if cosines.ndim != 1 or cosines.shape != sines.shape or not len(cosines):
        raise ConfigError(f"b: expected as many amplitudes as a has, {cosines.shape}, got {sines.shape}")
    return _series(cosines, sines, jnp.asarray(period, dtype=float), jnp.asarray(t, dtype=float))


@jax.jit
def _series(cosines: Array, sines: Array, period: Array, t: Array) -> tuple[Array, Array, Array]:
    frequency = 2.0 * math.pi / period * jnp.arange(1, len(cosines) + 1)
    x = jnp.mod(t, period) / period
    angle = x[..., None] * period * frequency
    wave, turned = jnp.cos(angle), jnp.sin(angle)
    # The series is the same at both ends, so that the polynomial takes away its value there and closes on itself.
    c0 = jnp.sum(sines / frequency)
    c1 = -period * jnp.sum(cosines)
    c2 = -0.5 * period**2 * jnp.sum(sines * frequency)
    c3, c4, c5 = -10.0 * c1 - 2.0 * c2, 15.0 * c1 + c2, -6.0 * c1
    position = c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
    slope = c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
    bend = 2.0 * c2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))
    q = turned @ (cosines / frequency) - wave @ (sines / frequency) + position
    rate = wave @ cosines + turned @ sines + slope / period
    acceleration = wave @ (sines * frequency) - turned @ (cosines * frequency) + bend / period**2
    return q, rate, acceleration
