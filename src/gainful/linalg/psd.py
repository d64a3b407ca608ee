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


def symmetrize(matrix: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """The symmetric part `(M + M^T) / 2`."""
    return 0.5 * (matrix + matrix.T)


def root(matrix: Float[Array, "n n"]) -> tuple[Float[Array, "n n"], Bool[Array, ""]]:
    """Lower-triangular `L` with `L L^T = P` for a positive semi-definite `P`, and whether `P` is one.

    A pivot below rounding of its own diagonal entry counts as zero, so the decision does not depend on units.
    """
    n = matrix.shape[0]
    tolerance = 8 * n * jnp.finfo(matrix.dtype).eps * jnp.abs(jnp.diagonal(matrix))
    if n > UNROLL_LIMIT:
        return _root_lapack(matrix, tolerance)
    columns = []
    valid = jnp.array(True)
    rest = matrix
    for j in range(n):
        pivot = rest[j, j]
        positive = pivot > tolerance[j]
        valid &= pivot >= -tolerance[j]
        scale = jnp.where(positive, jax.lax.rsqrt(jnp.where(positive, pivot, 1.0)), 0.0)
        column = rest[:, j] * scale
        column = jnp.where(jnp.arange(n) >= j, column, 0.0)
        columns.append(column)
        if j + 1 < n:
            rest = rest - column[:, None] * column[None, :]
    return jnp.stack(columns, axis=1), valid


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

    return jax.lax.cond(
        jnp.all(jnp.isfinite(definite)), lambda: (definite, jnp.array(True)), lambda: semidefinite()
    )


def _guarded_reciprocal(pivot: Array) -> Array:
    zero = pivot == 0
    return jnp.where(zero, 0.0, 1.0 / jnp.where(zero, 1.0, pivot))


def solve_lower(lower: Float[Array, "n n"], right: Float[Array, "n *k"]) -> Float[Array, "n *k"]:
    """`L^-1 B` by forward substitution; rows of zero pivots come out zero."""
    n = lower.shape[0]
    if n > UNROLL_LIMIT:
        return _solve_lapack(lower, right, transposed=False)
    rest, rows = right, []
    for j in range(n):
        row = rest[j] * _guarded_reciprocal(lower[j, j])
        rows.append(row)
        if j + 1 < n:
            rest = rest - _outer(lower[:, j], row)
    return jnp.stack(rows)


def solve_lower_transposed(lower: Float[Array, "n n"], right: Float[Array, "n *k"]) -> Float[Array, "n *k"]:
    """`L^-T B` by back substitution; rows of zero pivots come out zero."""
    n = lower.shape[0]
    if n > UNROLL_LIMIT:
        return _solve_lapack(lower, right, transposed=True)
    rest, rows = right, [right[0]] * n
    for j in reversed(range(n)):
        row = rest[j] * _guarded_reciprocal(lower[j, j])
        rows[j] = row
        if j:
            rest = rest - _outer(lower[j, :], row)
    return jnp.stack(rows)


def _outer(column: Array, row: Array) -> Array:
    return column * row if row.ndim == 0 else column[:, None] * row[None, :]


def _solve_lapack(lower: Array, right: Array, *, transposed: bool) -> Array:
    pivots = jnp.diagonal(lower)
    safe = lower + jnp.diag(jnp.where(pivots == 0, 1.0, 0.0).astype(lower.dtype))
    mask = (pivots != 0).reshape((-1,) + (1,) * (right.ndim - 1))
    flat = jnp.where(mask, right, 0.0).reshape(lower.shape[0], -1)
    solved = jax.scipy.linalg.solve_triangular(safe, flat, lower=True, trans=1 if transposed else 0)
    return jnp.where(mask, solved.reshape(right.shape), 0.0)
