"""The square-root estimate: mean and triangular factor of the covariance."""

from __future__ import annotations

from typing import Self

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..linalg import downdate, inverse_lower, product, root, triangularize
from ..spaces import AbstractSpace
from .affine import Affine
from .base import AbstractEstimate, Innovation, residual_of


class SquareRoot(AbstractEstimate):
    """Mean and lower-triangular root of the covariance, moved by orthogonal transformations only.

    The covariance is never formed, so it stays positive semi-definite and keeps twice the digits of the dense form.

    ```
    push       tri [A L, N^1/2]
    condition  tri [[A L, N^1/2], [L, 0]] = [[S^1/2, 0], [K S^1/2, L+]]
    ```

    Attributes:
        mean: a point of the space (size,).
        factor: root of the covariance (dof, dof).
        space: where the state lives.

    Source: Kaminski, Bryson and Schmidt (1971), IEEE Trans. Autom. Control 16(6):727-736.
    Reduces to: `Gaussian` in exact arithmetic.

    Example:
        >>> import jax.numpy as jnp
        >>> from gainful.spaces import Euclidean
        >>> SquareRoot.start(jnp.zeros(1), 4.0 * jnp.eye(1), Euclidean(("x",))).factor.tolist()
        [[2.0]]
    """

    mean: Float[Array, " size"]
    factor: Float[Array, "dof dof"]
    space: AbstractSpace

    # Written out, since type checkers would take the abstract `cov` for one more argument.
    def __init__(self, mean: Float[Array, " size"], factor: Float[Array, "dof dof"], space: AbstractSpace):
        self.mean = mean
        self.factor = factor
        self.space = space

    @classmethod
    def start(cls, mean: Float[Array, " size"], cov: Float[Array, "dof dof"], space: AbstractSpace) -> Self:
        return cls(mean, root(cov)[0], space)

    @property
    def cov(self) -> Float[Array, "dof dof"]:
        return product(self.factor, self.factor.T)

    @property
    def roots(self) -> tuple[Float[Array, "dof dof"], Float[Array, "dof dof"]]:
        return self.factor, inverse_lower(self.factor)

    def push(self, affine: Affine) -> Self:
        columns = jnp.concatenate([product(affine.matrix, self.factor), affine.columns()], axis=1)
        factor, _ = _less(triangularize(columns), affine.deficit)
        return type(self)(affine.predict(self.mean), factor, affine.outer)

    def condition(
        self,
        affine: Affine,
        y: Float[Array, " out_size"],
        seen: Bool[Array, " out"],
        *,
        gain: Float[Array, "dof out"] | None = None,
    ) -> tuple[Self, Innovation]:
        noise = affine.columns()
        m, n = affine.matrix.shape
        moved = product(affine.matrix, self.factor)
        beneath = jnp.zeros((n, noise.shape[1]), noise.dtype)
        deficit = jnp.concatenate([affine.deficit, jnp.zeros((n, affine.deficit.shape[1]), noise.dtype)])
        array, valid = _less(triangularize(jnp.block([[moved, noise], [self.factor, beneath]])), deficit)
        lower = array[:m, :m]
        residual = residual_of(affine, self.mean, y, seen)
        positive = valid & jnp.all(jnp.diagonal(lower) > 0)
        innovation = Innovation(residual, product(lower, lower.T), lower, inverse_lower(lower), seen, positive)
        if gain is None:
            correction, factor = array[m:, :m] @ innovation.whitened, array[m:, m:]
        else:
            correction = gain @ residual
            columns = jnp.concatenate([self.factor - product(gain, moved), product(gain, noise)], axis=1)
            factor, _ = _less(triangularize(columns), product(gain, affine.deficit))
        return type(self)(self.space.plus(self.mean, correction), factor, self.space), innovation

    def plus_noise(self, cov: Float[Array, "dof dof"]) -> Self:
        factor = triangularize(jnp.concatenate([self.factor, root(cov)[0]], axis=1))
        return type(self)(self.mean, factor, self.space)

    def revise(self, affine: Affine, future: Self) -> Self:
        noise = affine.columns()
        moved = product(affine.matrix, self.factor)
        lower, _ = _less(triangularize(jnp.concatenate([moved, noise], axis=1)), affine.deficit)
        inverse = inverse_lower(lower)
        gain = product(product(self.factor, product(inverse, moved).T), inverse)
        shift = gain @ affine.outer.minus(future.mean, affine.predict(self.mean))
        columns = jnp.concatenate(
            [self.factor - product(gain, moved), product(gain, noise), product(gain, future.factor)], axis=1
        )
        factor, _ = _less(triangularize(columns), product(gain, affine.deficit))
        return type(self)(self.space.plus(self.mean, shift), factor, self.space)


def _less(lower: Float[Array, "n n"], deficit: Float[Array, "n j"]) -> tuple[Float[Array, "n n"], Bool[Array, ""]]:
    """The root of `L L^T` less the deficit's columns, and whether something was left to take them from."""
    valid = jnp.array(True)
    for j in range(deficit.shape[1]):
        lower, kept = downdate(lower, deficit[:, j])
        valid &= kept
    return lower, valid
