"""What updates that change the noise within a step have in common."""

from __future__ import annotations

from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..estimates import AbstractEstimate
from ..linalg import product, root_and_inverse

Memory = TypeVar("Memory", bound=eqx.Module)


def excess(factors: Float[Array, " n"], cov: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """`E C E` with `E = diag(sqrt(factors - 1))`: added to C it multiplies the variances, and it is a covariance."""
    scale = jnp.sqrt(jnp.maximum(factors - 1.0, 0.0))
    return scale[:, None] * cov * scale[None, :]


def inflated(estimate: AbstractEstimate, cov: Float[Array, "n n"], active: Bool[Array, ""]) -> AbstractEstimate:
    """The estimate with covariance added where `active`; elsewhere itself, to the last bit."""
    more = estimate.plus_noise(cov)
    return jax.tree.map(lambda new, old: jnp.where(active, new, old), more, estimate)


def remembered(measured: Bool[Array, ""], new: Memory, old: Memory, inner: Any) -> Memory:
    """The new memory where something was measured, else the old; `inner`, which sees to itself, as it is."""
    chosen = jax.tree.map(lambda now, then: jnp.where(measured, now, then).astype(then.dtype), new, old)
    return eqx.tree_at(lambda memory: memory.inner, chosen, inner, is_leaf=lambda leaf: leaf is None)  # type: ignore[attr-defined]


def solve_least_squares(
    matrix: Float[Array, "m n"], weight: Float[Array, "m m"], ridge: Float[Array, " n"]
) -> Float[Array, "n m"]:
    """`(M^T W M + diag(ridge))^-1 M^T W`, a left inverse of `M` where the ridge is 0 and `M` has full column rank."""
    weighted = product(matrix.T, weight)
    _, inverse, _ = root_and_inverse(product(weighted, matrix) + jnp.diag(ridge))
    return product(inverse.T, product(inverse, weighted))
