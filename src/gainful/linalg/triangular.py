"""Orthogonal triangularisation and rank-one downdates: the square-root filters' two tools."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .psd import UNROLL_LIMIT


@jax.jit  # a loop called uncompiled would be compiled anew each time
def triangularize(columns: Float[Array, "n k"]) -> Float[Array, "n n"]:
    """Lower-triangular `L` with `L L^T = M M^T`, diagonal non-negative, by Householder reflections of the rows.

    Never forms `M M^T`, so it keeps the digits that squaring would lose. Put the columns of larger size first: the
    reflections then keep small entries of later columns to full relative accuracy.
    """
    n, k = columns.shape
    if k < n:
        columns = jnp.concatenate([columns, jnp.zeros((n, n - k), columns.dtype)], axis=1)
        k = n
    if n > UNROLL_LIMIT:
        lower = jnp.linalg.qr(columns.T, mode="r").T
        return lower * jnp.where(jnp.diagonal(lower) < 0, -1.0, 1.0)
    first = jnp.arange(k) == 0

    def reflect(j: Array, held: tuple[Array, Array]) -> tuple[Array, Array]:
        # Reflect row j onto the first axis, then take that axis out of all rows. A row already zero takes no axis out: its
        # column of L is zero, as in `root`.
        rest, lower = held
        row = rest[j]
        square = row @ row
        present = square > 0
        norm = jnp.where(present, jnp.sqrt(jnp.where(present, square, 1.0)), 0.0)
        sign = jnp.where(row[0] < 0, -1.0, 1.0).astype(rest.dtype)
        mirror = row + jnp.where(first, sign * norm, 0.0)
        length = norm * (norm + jnp.abs(row[0]))
        weight = jnp.where(present, 1.0 / jnp.where(present, length, 1.0), 0.0)
        rest = rest - (weight * (rest @ mirror))[:, None] * mirror[None, :]
        below = jnp.where(jnp.arange(n) > j, -sign * rest[:, 0], 0.0)
        column = jnp.where(jnp.arange(n) == j, norm, jnp.where(present, below, 0.0))
        return jnp.where(first & present, 0.0, rest), lower.at[:, j].set(column)

    # Rolled: unrolled, the reflections of a large array take longer to compile than most programs that use them.
    return jax.lax.fori_loop(0, n, reflect, (columns, jnp.zeros((n, n), columns.dtype)))[1]


def downdate(lower: Float[Array, "n n"], column: Float[Array, " n"]) -> tuple[Float[Array, "n n"], Bool[Array, ""]]:
    """Lower-triangular root of `L L^T - c c^T`, and whether that matrix is positive semi-definite.

    Source: Gill, Golub, Murray and Saunders (1974), Math. Comp. 28(126):505-535, hyperbolic rotations.
    """
    n = lower.shape[0]
    valid = jnp.array(True)
    columns, rest = [], column
    for j in range(n):
        pivot, x = lower[j, j], rest[j]
        square = (pivot - x) * (pivot + x)
        positive = square > 0
        valid &= positive | (x == 0)
        new = jnp.sqrt(jnp.where(positive, square, 1.0))
        cosine = jnp.where(positive, new / jnp.where(positive, pivot, 1.0), 1.0)
        sine = jnp.where(positive, x / jnp.where(positive, pivot, 1.0), 0.0)
        changed = (lower[:, j] - sine * rest) / cosine
        rest = cosine * rest - sine * changed
        columns.append(jnp.where(jnp.arange(n) >= j, changed, 0.0))
    return jax.tree.map(lambda new, old: jnp.where(valid, new, old), jnp.stack(columns, axis=1), lower), valid
