"""How far a point is from many centres."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float


def squared_distances(point: Float[Array, " p"], centres: Float[Array, "m p"]) -> Float[Array, " m"]:
    """`|point - c|^2` of each centre by one product of a matrix and a vector, `|point|^2 - 2 c.point + |c|^2`; 0 at a centre.

    That is several times as fast as sums of squared differences, and so are its derivatives, which ask for the same again.
    Where a point is at a centre, what rounding leaves is taken for 0.
    """
    size = point @ point + jnp.sum(centres**2, axis=1)
    squares = size - 2.0 * (centres @ point)
    # A sum of p terms is right to p units in the last place.
    return jnp.where(squares > len(point) * jnp.finfo(size.dtype).eps * size, squares, 0.0)
