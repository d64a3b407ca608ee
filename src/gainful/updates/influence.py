"""Huber's minimax influence function, and the threshold that a share of outliers asks for."""

from __future__ import annotations

import math
from typing import Any

import jax
import jax.numpy as jnp
import scipy.optimize
import scipy.special
from jaxtyping import Array, Float

from ..errors import ConfigError


def huber_threshold(contamination: float) -> float:
    """The threshold `k`, in sigmas, that is minimax where a share of measurements may be anything symmetric.

    ```
    2 phi(k) / k - 2 Phi(-k) = contamination / (1 - contamination)
    ```

    Args:
        contamination: share of outliers, from 0 (no threshold) to less than 1.

    Raises:
        ConfigError: a share outside these.

    Source: Huber (1964), Ann. Math. Statist. 35(1):73-101.

    Example:
        >>> round(huber_threshold(0.1), 5)
        1.14017
    """
    if not 0 <= contamination < 1:
        raise ConfigError(f"contamination: expected a share from 0 to less than 1, got {contamination!r}")
    if contamination == 0:
        return math.inf
    odds = contamination / (1.0 - contamination)

    def excess(k: float) -> float:
        return 2.0 * math.exp(-0.5 * k * k) / (math.sqrt(2.0 * math.pi) * k) - 2.0 * scipy.special.ndtr(-k) - odds

    if odds < 1e-300:
        return 38.0  # sigmas; beyond them the normal density is 0 in double precision
    return scipy.optimize.root_scalar(excess, bracket=(1e-9, 38.0), xtol=1e-15, rtol=1e-14).root


def chosen_threshold(contamination: float, threshold: Any) -> Any:
    """The threshold given, or the one that a share of outliers asks for.

    Raises:
        ConfigError: no such share, or a plain number that is not above 0.
    """
    asked = huber_threshold(contamination)
    if threshold is None:
        return asked
    if isinstance(threshold, (int, float)) and not threshold > 0:
        raise ConfigError(f"threshold: expected a number of sigmas above 0, got {threshold!r}")
    return threshold


def huber_fisher_information(threshold: float | Float[Array, ""]) -> Float[Array, ""]:
    """Fisher information of the least favourable density for a threshold: its mean `psi'` and its mean `psi^2`.

    Args:
        threshold: in sigmas; 1 for an infinite one.

    Source: Huber (1964), Ann. Math. Statist. 35(1):73-101; Masreliez and Martin (1977), IEEE TAC 22(3):361-371.

    Example:
        >>> round(float(huber_fisher_information(huber_threshold(0.1))), 5)
        0.67121
    """
    k = jnp.asarray(threshold, float)
    finite = jnp.where(jnp.isinf(k), 1.0, k)
    inside = jax.scipy.special.erf(finite / math.sqrt(2.0))
    outside = 2.0 * jnp.exp(-0.5 * finite**2) / (jnp.sqrt(2.0 * jnp.pi) * finite)
    return jnp.where(jnp.isinf(k), 1.0, inside / (inside + outside))


def huber_psi(residual: Float[Array, " m"], threshold: Any) -> Float[Array, " m"]:
    """`clip(v, -k, k)`: how far a normalised residual pulls.

    Args:
        residual: in sigmas.
        threshold: in sigmas.
    """
    return jnp.clip(residual, -threshold, threshold)


def huber_rho(residual: Float[Array, " m"], threshold: Any) -> Float[Array, " m"]:
    """What a normalised residual costs: `v^2 / 2` up to the threshold, growing linearly beyond.

    Args:
        residual: in sigmas.
        threshold: in sigmas.
    """
    size = jnp.abs(residual)
    inside = jnp.minimum(size, threshold)
    return inside * (size - 0.5 * inside)


def huber_weight(residual: Float[Array, " m"], threshold: Any) -> Float[Array, " m"]:
    """`psi(v) / v`: 1 up to the threshold, falling like `k / |v|` beyond.

    Args:
        residual: in sigmas.
        threshold: in sigmas.
    """
    size = jnp.abs(residual)
    return jnp.where(size > threshold, threshold / jnp.where(size > threshold, size, 1.0), 1.0)
