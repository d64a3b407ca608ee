"""Products of small matrices, written so that a whole filter step compiles into one function."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

_INLINE = 8
"""XLA writes products out itself while every side is shorter than this; longer ones it hands to a library."""
_MULTIPLICATIONS = 2500
"""Products up to this size gain more from staying inside a compiled loop than from the library."""


def product(left: Float[Array, "n k"], right: Float[Array, "k m"]) -> Float[Array, "n m"]:
    """`left @ right`, as a sum of products where a call into a library would break up the loop around it."""
    (n, k), m = left.shape, right.shape[1]
    if max(n, k, m) < _INLINE or n * k * m > _MULTIPLICATIONS:
        return left @ right
    return jnp.sum(left[:, :, None] * right[None, :, :], axis=1)


def congruence(matrix: Float[Array, "n k"], cov: Float[Array, "k k"]) -> Float[Array, "n n"]:
    """`A P A^T`: what a covariance becomes under a linear map."""
    return product(product(matrix, cov), matrix.T)


def times_inverse(cross: Float[Array, "m n"], inverse: Float[Array, "m m"]) -> Float[Array, "n m"]:
    """`C^T S^-1` for `S = L L^T`, given `L^-1`: the optimal gain where `C = A P`."""
    return product(product(inverse, cross).T, inverse)


def symmetrize(matrix: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """The symmetric part `(M + M^T) / 2`."""
    return 0.5 * (matrix + matrix.T)


def joseph(
    cov: Float[Array, "n n"], gain: Float[Array, "n m"], matrix: Float[Array, "m n"], noise: Float[Array, "m m"]
) -> Float[Array, "n n"]:
    """`(I - K A) P (I - K A)^T + K N K^T`: a covariance whatever the gain.

    Source: Bucy and Joseph (1968), Filtering for Stochastic Processes with Applications to Guidance.
    """
    keep = jnp.eye(cov.shape[0], dtype=cov.dtype) - product(gain, matrix)
    return symmetrize(congruence(keep, cov) + congruence(gain, noise))
