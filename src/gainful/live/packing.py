"""Trees of arrays as one vector: each array that crosses into XLA costs more than a small filter's arithmetic."""

from __future__ import annotations

import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Packed = tuple[Float[Array, " n"], *tuple[Array, ...]]
"""The numbers of one type as a vector, then whatever is of another type."""


def pack(tree: Any, dtype: Any) -> tuple[Packed, Any]:
    """A tree's arrays, those of `dtype` side by side in one vector, and what it takes to put it together again."""
    arrays, rest = eqx.partition(tree, eqx.is_array)
    leaves, structure = jax.tree.flatten(arrays)
    leaves = [jnp.asarray(leaf) for leaf in leaves]
    shapes = tuple(leaf.shape if leaf.dtype == dtype else "apart" for leaf in leaves)
    own = [leaf.ravel() for leaf in leaves if leaf.dtype == dtype]
    vector = jnp.concatenate(own) if own else jnp.zeros(0, dtype)
    return (vector, *(leaf for leaf in leaves if leaf.dtype != dtype)), (structure, shapes, rest)


def unpack(packed: Packed, left: Any) -> Any:
    """The tree that `pack` took apart."""
    structure, shapes, rest = left
    vector, others = packed[0], iter(packed[1:])
    leaves, start = [], 0
    for shape in shapes:
        if shape == "apart":
            leaves.append(next(others))
            continue
        stop = start + math.prod(shape)
        leaves.append(vector[start:stop].reshape(shape))
        start = stop
    return eqx.combine(jax.tree.unflatten(structure, leaves), rest)
