"""Rows of several sensors: summed, averaged, compared, and shifted in time against each other."""

from __future__ import annotations

import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..errors import DataError, ShapeError
from .row_noise import AbstractRowNoise


@jax.jit
def information(rows: Float[Array, "*batch T s p"], weights: Any = None) -> Float[Array, "*batch p p"]:
    """`sum_k sum_i w_i d_i(k) d_i(k)^T`: the rows of all sensors stacked.

    Where sensors see the same motion at the same moments, `average` them first: stacked, each keeps its own noise, and least
    squares its whole bias.

    Args:
        rows: `[h, z]` of every sensor; rows with a NaN count for nothing.
        weights: per sensor, inverse to its noise; 1 each by default.

    Example:
        >>> information(jnp.array([[[1.0, 2.0]], [[jnp.nan, 1.0]]])).tolist()
        [[1.0, 2.0], [2.0, 4.0]]
    """
    table, whole = _whole(rows)
    scaled = table * _weights(weights, table)[:, None]
    return jnp.einsum("...tsi,...tsj->...ij", jnp.where(whole[..., None], scaled, 0.0), table)


@jax.jit
def count_rows(rows: Float[Array, "*batch T s p"]) -> Float[Array, "*batch"]:
    """How many rows are whole, of all sensors together.

    Example:
        >>> float(count_rows(jnp.array([[[1.0, 2.0]], [[jnp.nan, 1.0]]])))
        1.0
    """
    _, whole = _whole(rows)
    return jnp.sum(whole, axis=(-2, -1)).astype(float)


@eqx.filter_jit
def accumulated_noise(rows: Float[Array, "*batch T s p"], noise: AbstractRowNoise) -> Float[Array, "*batch p p"]:
    """`sum_k sum_i Sigma_i(k)`: the noise in `information`, if that of a sensor of weight w has the covariance `Sigma / w`.

    Args:
        rows: `[h, z]` of every sensor; rows with a NaN count for nothing.
        noise: covariance of the noise of a row of weight 1.
    """
    table, whole = _whole(rows)
    flat = table.reshape(-1, table.shape[-1])
    covariances = jax.vmap(noise)(flat).reshape(*table.shape, table.shape[-1])
    return jnp.einsum("...ts,...tsij->...ij", whole.astype(table.dtype), covariances)


@jax.jit
def average(rows: Float[Array, "*batch T s p"], weights: Any = None) -> Float[Array, "*batch T 1 p"]:
    """The weighted mean row of sensors that see the same motion at the same moments: all that there is to know of it.

    Its noise has the covariance `(sum_i Sigma_i^-1)^-1` for weights inverse to `Sigma_i`: that of one sensor over their number
    where all are alike.

    Args:
        rows: `[h, z]` of every sensor; a sensor with a NaN is left out of its moment's mean.
        weights: per sensor, inverse to its noise; 1 each by default.

    Returns:
        The rows of one sensor, NaN where none measured.

    Example:
        >>> average(jnp.array([[[1.0, 2.0], [3.0, 2.0]]])).tolist()
        [[[2.0, 2.0]]]
    """
    table, whole = _whole(rows)
    counted = jnp.where(whole, _weights(weights, table), 0.0)
    total = jnp.sum(counted, axis=-1)[..., None, None]
    mean = jnp.sum(counted[..., None] * table, axis=-2, keepdims=True)
    return jnp.where(total > 0, mean / jnp.where(total > 0, total, 1.0), jnp.nan)


def noise_from_differences(first: Float[Array, "T p"], second: Float[Array, "T p"]) -> Float[Array, "p p"]:
    """Covariance of the noise of one row, from two sensors of the same motion: half the mean square of their difference.

    Captures correlations between columns and noise that changes with the motion, on average over the record; not what both
    sensors have in common, such as a shared record of the wrench, whose variance is to be added by hand. The mean of the two
    sensors has half of it.

    Args:
        first: rows `[h, z]` of one sensor.
        second: of another with independent and equal noise.

    Raises:
        DataError: rows that do not differ at all, so that there is one sensor, or fewer than two whole rows.

    Source: Fuller (1987), Measurement Error Models, section 2.4, replicated observations.

    Example:
        >>> noise_from_differences(jnp.array([[1.0], [2.0]]), jnp.array([[1.2], [1.8]])).round(6).tolist()
        [[0.02]]
    """
    gap = jnp.asarray(first) - jnp.asarray(second)
    if gap.ndim != 2:
        raise ShapeError(f"first: expected shape (times, columns), got {gap.shape}")
    whole = jnp.all(jnp.isfinite(gap), axis=1)
    gap = jnp.where(whole[:, None], gap, 0.0)
    if not isinstance(gap, Tracer):
        if int(whole.sum()) < 2:
            raise DataError(f"first: expected at least two rows whole in both sensors, got {int(whole.sum())}")
        if not np.any(np.asarray(gap)):
            raise DataError("second: expected a sensor of its own, got the same rows as those of the first")
    return 0.5 * jnp.einsum("ti,tj->ij", gap, gap) / jnp.sum(whole)


def sensor_lag(first: Float[Any, " T"], second: Float[Any, " T"], dt: float, limit: float) -> float:
    """By how much one signal comes later than another [s], where their correlation is highest.

    One sample of lag turns a derivative against its rate, so align sensors before regressing on them.

    Args:
        first: of one sensor.
        second: the same quantity of another.
        dt: time between samples [s].
        limit: largest lag looked for, either way [s].

    Returns:
        The lag of the second signal, positive where it is late, to a fraction of a sample.

    Raises:
        ShapeError: signals of different lengths.
        DataError: a signal that does not move, or is not longer than twice the limit.

    Source: Knapp and Carter (1976), IEEE Trans. Acoust. Speech Signal Process. 24(4):320-327, without prefilter.

    Example:
        >>> t = np.arange(200) * 0.05
        >>> round(sensor_lag(np.sin(t), np.sin(t - 0.2), 0.05, 1.0), 2)
        0.2
    """
    a, b = (np.asarray(each, dtype=float) for each in (first, second))
    if a.ndim != 1 or a.shape != b.shape:
        raise ShapeError(f"second: expected shape {a.shape}, as the first signal, got {b.shape}")
    reach = math.ceil(limit / dt)
    if len(a) <= 2 * reach + 2:
        raise DataError(f"first: expected more than {2 * reach + 2} samples for a limit of {limit:g} s, got {len(a)}")
    both = np.isfinite(a) & np.isfinite(b)
    a, b = (np.where(both, each - each[both].mean(), 0.0) for each in (a, b))
    if not (a.any() and b.any()):
        raise DataError("first: expected signals that move, got a constant")
    middle = slice(reach + 1, len(a) - reach - 1)
    shifts = np.arange(-reach - 1, reach + 2)
    pieces = [b[reach + 1 + k : len(b) - reach - 1 + k] for k in shifts]
    likeness = np.array([a[middle] @ piece / max(np.linalg.norm(piece), 1e-300) for piece in pieces])
    best = 1 + int(likeness[1:-1].argmax())
    left, top, right = likeness[best - 1 : best + 2]
    bend = left - 2 * top + right
    return float(dt * (shifts[best] + (0.5 * (left - right) / bend if bend < 0 else 0.0)))


def _whole(rows: Any) -> tuple[Array, Array]:
    """The rows with zeros where they are not whole, and which are."""
    table = jnp.asarray(rows)
    if table.ndim < 3:
        raise ShapeError(f"rows: expected shape (..., times, sensors, columns and regressand), got {table.shape}")
    whole = jnp.all(jnp.isfinite(table), axis=-1)
    return jnp.where(whole[..., None], table, 0.0), whole


def _weights(given: Any, table: Array) -> Array:
    if given is None:
        return jnp.ones(table.shape[-2], table.dtype)
    weights = jnp.asarray(given, table.dtype)
    if weights.shape != (table.shape[-2],):
        raise ShapeError(f"weights: expected {table.shape[-2]}, one per sensor, got shape {weights.shape}")
    return weights
