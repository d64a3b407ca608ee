"""Roots of, and solves with, positive semi-definite matrices.

Covariances are often singular on purpose: a parameter known exactly, a state without process noise. The Cholesky root
below sets the column of a vanishing pivot to zero, and the triangular solves skip such columns, so `L L^T = P` holds
and solves are least-norm along the range. Loops over columns are unrolled: all sizes here are small and static.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

UNROLL_LIMIT = 24
"""Matrices up to this size are factored by unrolled column operations, larger ones by LAPACK."""


def root(matrix: Float[Array, "n n"]) -> tuple[Float[Array, "n n"], Bool[Array, ""]]:
    """Lower-triangular `L` with `L L^T = P` for a positive semi-definite `P`, and whether `P` is one.

    A pivot below rounding of its own diagonal entry counts as zero, so the decision does not depend on units.
    """
    lower, _, valid = _eliminate(matrix, inverse=False)
    return lower, valid


def root_and_inverse(
    matrix: Float[Array, "n n"],
) -> tuple[Float[Array, "n n"], Float[Array, "n n"], Bool[Array, ""]]:
    """`L`, `L^-1` (zero rows for zero pivots) and whether `P = L L^T` is positive semi-definite, in one elimination."""
    return _eliminate(matrix, inverse=True)


def _eliminate(matrix: Array, *, inverse: bool) -> tuple[Array, Array, Array]:
    """Gauss elimination of `[P | I]`, which turns into `[L^T | L^-1]` row by row."""
    n = matrix.shape[0]
    if n == 0:
        return matrix, matrix, jnp.array(True)
    tolerance = 8 * n * jnp.finfo(matrix.dtype).eps * jnp.abs(jnp.diagonal(matrix))
    if n > UNROLL_LIMIT:
        lower, valid = _root_lapack(matrix, tolerance)
        return lower, inverse_lower(lower) if inverse else lower, valid
    rest = jnp.concatenate([matrix, jnp.eye(n, dtype=matrix.dtype)], axis=1) if inverse else matrix
    rows, pivots = [], []
    for j in range(n):
        pivot = rest[0, j]
        positive = pivot > tolerance[j]
        scale = jnp.where(positive, jax.lax.rsqrt(jnp.where(positive, pivot, 1.0)), 0.0)
        row = rest[0] * scale
        rows.append(row)
        pivots.append(pivot)
        rest = rest[1:] - (rest[1:, j] * scale)[:, None] * row[None, :]
    table = jnp.stack(rows)
    return jnp.triu(table[:, :n]).T, table[:, n:], jnp.all(jnp.stack(pivots) >= -tolerance)


def _root_lapack(
    matrix: Float[Array, "n n"], tolerance: Float[Array, " n"]
) -> tuple[Float[Array, "n n"], Bool[Array, ""]]:
    definite = jnp.linalg.cholesky(matrix)

    def semidefinite() -> tuple[Array, Array]:
        # QR of the symmetric root gives a triangular one whatever the rank.
        values, vectors = jnp.linalg.eigh(matrix)
        half = vectors * jnp.sqrt(jnp.clip(values, 0.0, None))
        upper = jnp.linalg.qr(half.T, mode="r")
        return upper.T * jnp.sign(jnp.diagonal(upper) + (jnp.diagonal(upper) == 0)), values[0] >= -jnp.max(tolerance)

    return jax.lax.cond(jnp.all(jnp.isfinite(definite)), lambda: (definite, jnp.array(True)), lambda: semidefinite())


def inverse_lower(lower: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """`L^-1` of a lower-triangular matrix; rows of zero pivots come out zero."""
    n = lower.shape[0]
    if n == 0:
        return lower
    identity = jnp.eye(n, dtype=lower.dtype)
    if n > UNROLL_LIMIT:
        pivots = jnp.diagonal(lower)
        safe = lower + jnp.diag(jnp.where(pivots == 0, 1.0, 0.0).astype(lower.dtype))
        inverse = jax.scipy.linalg.solve_triangular(safe, identity, lower=True)
        return jnp.where((pivots != 0)[:, None] & (pivots != 0)[None, :], inverse, 0.0)
    rest, rows = identity, []
    for j in range(n):
        pivot = lower[j, j]
        zero = pivot == 0
        row = rest[0] * jnp.where(zero, 0.0, 1.0 / jnp.where(zero, 1.0, pivot))
        rows.append(row)
        rest = rest[1:] - lower[j + 1 :, j, None] * row[None, :]
    return jnp.stack(rows)
