"""Regression on one sensor with another as the instrument."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import Status
from .batch import Fit
from .uncertainty import sandwich_covariance


def instrumental_variables(first: Float[Array, "T p"], second: Float[Array, "T p"], *, lag: int = 0) -> Fit:
    """Regression on two sensors, each the instrument of the other: consistent without knowing how noisy they are.

    ```
    theta = (H1^T H2 + H2^T H1)^-1 (H1^T z2 + H2^T z1)
    ```

    Asks that the noise of one sensor's regressors be independent of the other's, and of the other's regressand. A shared
    regressand is fine; the same sensor recorded twice is not two sensors, nor is a wrench computed from one of them.

    Args:
        first: rows `[h, z]` of one sensor, in the order of time; moments with a NaN in either are left out.
        second: of the other.
        lag: rows over which noise is correlated, for the covariance; for rows that went through a filter about twice its
            length.

    Returns:
        The fit; its noise scale is the covariance of the two sensors' residuals, which is the variance of what they share.

    Source: Reiersol (1941), Econometrica 9(1):1-24; Soderstrom and Stoica (1983), Instrumental Variable Methods.
    Reduces to: `least_squares` for two sensors without noise.

    Example:
        >>> rows = jnp.array([[1.0, 2.0], [2.0, 4.0], [3.0, 6.0]])
        >>> instrumental_variables(rows, rows).theta.tolist()
        [2.0]
    """
    return _crossed(jnp.asarray(first, dtype=float), jnp.asarray(second, dtype=float), lag)


@functools.partial(jax.jit, static_argnums=2)
def _crossed(a: Float[Array, "T p"], b: Float[Array, "T p"], lag: int) -> Fit:
    whole = jnp.all(jnp.isfinite(a) & jnp.isfinite(b), axis=-1, keepdims=True)
    a, b = (jnp.where(whole, each, 0.0) for each in (a, b))
    cross = a[:, :-1].T @ b
    back = b[:, :-1].T @ a
    n = cross.shape[0]
    both = 0.5 * (cross + back)
    matrix = both[:, :n]
    # Cross products of sensors that see the same motion are positive definite when there is motion.
    scale = jnp.sqrt(jnp.abs(jnp.diagonal(matrix)))
    size = jnp.where(scale > 0, scale, 1.0)
    least = jnp.linalg.eigvalsh(matrix / jnp.outer(size, size))[0]
    count = jnp.sum(whole)
    good = (count > n) & (least > 8 * n * jnp.finfo(a.dtype).eps)
    theta = jnp.linalg.solve(jnp.where(good, matrix, jnp.eye(n)), both[:, n])
    q1, q2 = (each[:, -1] - each[:, :-1] @ theta for each in (a, b))
    scores = 0.5 * (a[:, :-1] * q2[:, None] + b[:, :-1] * q1[:, None])
    return _fitted(theta, matrix, scores, (q1 @ q2) / jnp.maximum(count - n, 1), count, good, lag)


def instrumented(rows: Float[Array, "T p"], instruments: Float[Array, "T n"], *, lag: int = 0) -> Fit:
    """Regression with instruments: signals that move as the regressors do, and know nothing of the noise.

    ```
    theta = (W^T H)^-1 W^T z
    ```

    Such as the regressors of a simulated motion, or of an earlier one under the same input.

    Args:
        rows: `[h, z]`, in the order of time; moments with a NaN in rows or instruments are left out.
        instruments: `W`, one per regressor.
        lag: rows over which residuals are correlated, for the covariance.

    Returns:
        The fit; its noise scale is the variance of the residuals.

    Source: Soderstrom and Stoica (1983), Instrumental Variable Methods for System Identification.
    Reduces to: `least_squares` for the regressors as their own instruments.

    Example:
        >>> rows = jnp.array([[1.0, 2.0], [2.0, 4.0], [3.0, 6.0]])
        >>> instrumented(rows, jnp.ones((3, 1))).theta.tolist()
        [2.0]
    """
    return _through(jnp.asarray(rows, dtype=float), jnp.asarray(instruments, dtype=float), lag)


@functools.partial(jax.jit, static_argnums=2)
def _through(d: Float[Array, "T p"], w: Float[Array, "T n"], lag: int) -> Fit:
    whole = jnp.all(jnp.isfinite(d), axis=-1, keepdims=True) & jnp.all(jnp.isfinite(w), axis=-1, keepdims=True)
    d, w = (jnp.where(whole, each, 0.0) for each in (d, w))
    n, count = w.shape[1], jnp.sum(whole)
    cross = w.T @ d
    matrix = cross[:, :n]
    first, second = (jnp.sqrt(jnp.sum(each**2, axis=0)) for each in (w, d[:, :n]))
    inner = matrix / jnp.outer(jnp.where(first > 0, first, 1.0), jnp.where(second > 0, second, 1.0))
    least = jnp.linalg.svd(inner, compute_uv=False)[-1]
    good = (count > n) & (least > 8 * n * jnp.finfo(d.dtype).eps)
    theta = jnp.linalg.solve(jnp.where(good, matrix, jnp.eye(n)), cross[:, n])
    q = d[:, -1] - d[:, :-1] @ theta
    return _fitted(theta, matrix, w * q[:, None], (q @ q) / jnp.maximum(count - n, 1), count, good, lag)


def _fitted(theta: Array, matrix: Array, scores: Array, scale: Array, count: Array, good: Array, lag: int) -> Fit:
    """The fit with its sandwich covariance, NaN where there is none."""
    n = len(theta)
    cov = sandwich_covariance(scores, jnp.where(good, matrix, jnp.eye(n)), lag)
    status = jnp.where(good, Status.ok, jnp.where(count > n, Status.ill_separated, Status.insufficient_data))
    return Fit(
        jnp.where(good, theta, jnp.nan),
        jnp.where(good, cov, jnp.nan),
        scale,
        jnp.asarray(jnp.inf),
        status.astype(jnp.int32),
    )
