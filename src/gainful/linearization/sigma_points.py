"""Statistical linear regression over sigma points: no Jacobian."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..estimates import AbstractEstimate, Affine
from ..linalg import product
from ..spaces import AbstractSpace
from .base import AbstractLinearization
from .rules import AbstractRule, Unscented

_MEAN_ITERATIONS = 6
"""Each iteration of the mean on a curved space takes off a share of the error that shrinks with the spread squared."""


class SigmaPoints(AbstractLinearization):
    """The affine map with the least mean squared error over the estimate, and that error's covariance.

    ```
    x_i = m [+] L xi_i;  y_i = f(x_i);  value = mean of y_i;  A = cov(y, x) P^-1;  error = cov(y - A x)
    ```

    The choice behind the unscented, cubature and Gauss-Hermite filters: `A P A^T + error` is the sigma-point covariance
    of `f`, and conditioning on the map is the sigma-point update.

    Attributes:
        rule: where the points lie.

    Source: Lefebvre, Bruyninckx and De Schutter (2002), IEEE Trans. Autom. Control 47(8):1406-1408.
    Reduces to: `Taylor` for affine functions.
    """

    rule: AbstractRule = Unscented()

    def __call__(
        self,
        fn: Callable[[Float[Array, " in_size"]], Float[Array, " out_size"]],
        estimate: AbstractEstimate,
        out_space: AbstractSpace,
    ) -> Affine:
        at, space = estimate.mean, estimate.space
        factor, inverse = estimate.roots
        rule = self.rule.points(space.dof)
        points = jax.vmap(space.plus, in_axes=(None, 1))(at, product(factor, jnp.asarray(rule[0], at.dtype)))
        value, slope, left = regression(jax.vmap(fn)(points), rule, out_space)
        deficit, error = signed_columns(left, rule[2])
        noise = jnp.zeros((out_space.dof, out_space.dof), at.dtype)
        return Affine(value, product(slope, inverse), at, noise, error, deficit, space, out_space)


def regression(
    images: Float[Array, "k size"], rule: tuple[np.ndarray, np.ndarray, np.ndarray], space: AbstractSpace
) -> tuple[Float[Array, " size"], Float[Array, "dof n"], Float[Array, "dof k"]]:
    """The mean of the images, their slope over the unit points `xi`, and what the slope leaves of each.

    `cov(y, x) = M L^T` with `M = sum w y_i xi_i^T`, so the slope over `x` is `M L^-1` and no covariance is inverted.
    """
    unit, mean_weights, cov_weights = rule
    value, spread = _mean_and_spread(images, mean_weights, space, int(np.argmin((unit**2).sum(axis=0))))
    slope = product(spread, jnp.asarray(unit.T * cov_weights[:, None], images.dtype))
    return value, slope, spread - product(slope, jnp.asarray(unit, images.dtype))


def signed_columns(
    columns: Float[Array, "dof k"], weights: np.ndarray
) -> tuple[Float[Array, "dof j"], Float[Array, "dof i"]]:
    """Columns times the roots of their weights: those of negative weight, then the others."""
    order = np.argsort(weights >= 0, kind="stable")
    if (order != np.arange(len(order))).any():
        columns = columns[:, order]
    scaled = columns * jnp.asarray(np.sqrt(np.abs(weights[order])), columns.dtype)
    negative, positive = jnp.split(scaled, [int(np.sum(weights < 0))], axis=1)
    return negative, positive


def _mean_and_spread(
    images: Float[Array, "k size"], weights: np.ndarray, space: AbstractSpace, centre: int
) -> tuple[Float[Array, " size"], Float[Array, "dof k"]]:
    """The weighted mean in the space, and how each point differs from it."""
    w = jnp.asarray(weights, images.dtype)

    def differences(mean: Array, out_axis: int) -> Array:
        return jax.vmap(space.minus, in_axes=(0, None), out_axes=out_axis)(images, mean)

    def improve(mean: Array) -> Array:
        return space.plus(mean, w @ differences(mean, 0))

    if space.curved:
        mean = jax.lax.fori_loop(0, _MEAN_ITERATIONS, lambda _, mean: improve(mean), images[centre])
    else:
        mean = improve(images[centre])
    return mean, differences(mean, 1)
