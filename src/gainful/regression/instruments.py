"""Regression on one sensor with another as the instrument."""

from __future__ import annotations

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
    a, b = (jnp.asarray(each, dtype=float) for each in (first, second))
    whole = jnp.all(jnp.isfinite(a) & jnp.isfinite(b), axis=-1, keepdims=True)
    a, b = (jnp.where(whole, each, 0.0) for each in (a, b))
    cross = a[:, :-1].T @ b
    back = b[:, :-1].T @ a
    n = cross.shape[0]
    both = 0.5 * (cross + back)
    matrix = both[:, :n]
    # Cross products of sensors that see the same motion are positive definite when there is motion.
    scale = jnp.sqrt(jnp.abs(jnp.diagonal(matrix)))
    least = jnp.linalg.eigvalsh(matrix / jnp.outer(*(jnp.where(scale > 0, scale, 1.0),) * 2))[0]
    count = jnp.sum(whole)
    good = (count > n) & (least > 8 * n * jnp.finfo(a.dtype).eps)
    theta = jnp.linalg.solve(jnp.where(good, matrix, jnp.eye(n)), both[:, n])
    q1, q2 = (each[:, -1] - each[:, :-1] @ theta for each in (a, b))
    scores = 0.5 * (a[:, :-1] * q2[:, None] + b[:, :-1] * q1[:, None])
    cov = sandwich_covariance(scores, jnp.where(good, matrix, jnp.eye(n)), lag)
    status = jnp.where(good, Status.ok, jnp.where(count > n, Status.ill_separated, Status.insufficient_data))
    shared = (q1 @ q2) / jnp.maximum(count - n, 1)
    return Fit(
        jnp.where(good, theta, jnp.nan),
        jnp.where(good, cov, jnp.nan),
        shared,
        jnp.asarray(jnp.inf),
        status.astype(jnp.int32),
    )
