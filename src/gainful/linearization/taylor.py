"""First-order expansion at the mean."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..estimates import AbstractEstimate, Affine
from ..spaces import AbstractSpace
from .base import AbstractLinearization


class Taylor(AbstractLinearization):
    """The tangent at the mean, by automatic differentiation: `A = d(f(m [+] d) [-] f(m)) / dd` at `d = 0`.

    The choice behind the extended Kalman filter. Its error is of second order in the spread and is not accounted for.

    Source: Smith, Schmidt and McGee (1962), NASA TR R-135.
    """

    def __call__(
        self,
        fn: Callable[[Float[Array, " in_size"]], Float[Array, " out_size"]],
        estimate: AbstractEstimate,
        out_space: AbstractSpace,
    ) -> Affine:
        at, space = estimate.mean, estimate.space
        value = fn(at)
        still = jnp.zeros(space.dof, at.dtype)
        _, tangent = jax.linearize(lambda d: out_space.minus(fn(space.plus(at, d)), value), still)
        matrix = jax.vmap(tangent, out_axes=1)(jnp.eye(space.dof, dtype=at.dtype))
        none = jnp.zeros((out_space.dof, 0), at.dtype)
        noise = jnp.zeros((out_space.dof, out_space.dof), at.dtype)
        return Affine(value, matrix, at, noise, none, none, space, out_space)
