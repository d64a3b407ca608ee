"""How far a point is from many centres."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float


@jax.custom_jvp
def squared_distances(point: Float[Array, " p"], centres: Float[Array, "m p"]) -> Float[Array, " m"]:
    """`|point - c|^2` of each centre, by differences: exactly 0 at a centre.

    Its derivatives along a direction are taken by a product of matrix and vector, so that those along many directions are
    one product of matrices.
    """
    return jnp.sum((point - centres) ** 2, axis=1)


def _slope(primals: tuple[Array, Array], tangents: tuple[Any, Any]) -> tuple[Array, Array]:
    (point, centres), (along, moved) = primals, tangents
    change = jnp.zeros(len(centres), point.dtype)
    if not isinstance(along, SymbolicZero):
        change = change + 2.0 * (point @ along - centres @ along)
    if not isinstance(moved, SymbolicZero):
        change = change - 2.0 * jnp.sum((point - centres) * moved, axis=1)
    return squared_distances(point, centres), change


squared_distances.defjvp(_slope, symbolic_zeros=True)
