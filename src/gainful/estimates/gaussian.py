"""The dense estimate: mean and covariance."""

from __future__ import annotations

from typing import Self

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..linalg import congruence, joseph, product, root_and_inverse, symmetrize, times_inverse
from ..spaces import AbstractSpace
from .affine import Affine
from .base import AbstractEstimate, Innovation, backward_gain, residual_of


class Gaussian(AbstractEstimate):
    """Mean and covariance, conditioned in Joseph form.

    ```
    push       P <- A P A^T + N
    condition  S = A P A^T + N;  K = P A^T S^-1;  P <- (I - K A) P (I - K A)^T + K N K^T
    ```

    Attributes:
        mean: a point of the space (size,).
        cov: covariance (dof, dof).
        space: where the state lives.

    Source: Bucy and Joseph (1968), Filtering for Stochastic Processes with Applications to Guidance.

    Example:
        >>> import jax.numpy as jnp
        >>> from gainful.spaces import Euclidean
        >>> Gaussian.start(jnp.zeros(1), jnp.eye(1), Euclidean(("x",))).factor.tolist()
        [[1.0]]
    """

    mean: Float[Array, " size"]
    cov: Float[Array, "dof dof"]
    space: AbstractSpace

    # Written out, since type checkers would take the abstract `factor` for one more argument.
    def __init__(self, mean: Float[Array, " size"], cov: Float[Array, "dof dof"], space: AbstractSpace):
        self.mean = mean
        self.cov = cov
        self.space = space

    @classmethod
    def start(cls, mean: Float[Array, " size"], cov: Float[Array, "dof dof"], space: AbstractSpace) -> Self:
        return cls(mean, cov, space)

    @property
    def factor(self) -> Float[Array, "dof dof"]:
        return self.roots[0]

    @property
    def roots(self) -> tuple[Float[Array, "dof dof"], Float[Array, "dof dof"]]:
        lower, inverse, _ = root_and_inverse(self.cov)
        return lower, inverse

    def push(self, affine: Affine) -> Self:
        cov = congruence(affine.matrix, self.cov) + affine.covariance()
        return type(self)(affine.predict(self.mean), symmetrize(cov), affine.outer)

    def condition(
        self,
        affine: Affine,
        y: Float[Array, " out_size"],
        seen: Bool[Array, " out"],
        *,
        gain: Float[Array, "dof out"] | None = None,
    ) -> tuple[Self, Innovation]:
        cross = product(affine.matrix, self.cov)
        noise = affine.covariance()
        spread = symmetrize(product(cross, affine.matrix.T) + noise)
        lower, inverse, _ = root_and_inverse(spread)
        residual = residual_of(affine, self.mean, y, seen)
        innovation = Innovation(residual, spread, lower, inverse, seen, jnp.all(jnp.diagonal(lower) > 0))
        if gain is None:
            gain = times_inverse(cross, inverse)
        cov = joseph(self.cov, gain, affine.matrix, noise)
        return type(self)(self.space.plus(self.mean, gain @ residual), cov, self.space), innovation

    def plus_noise(self, cov: Float[Array, "dof dof"]) -> Self:
        return type(self)(self.mean, self.cov + cov, self.space)

    def revise(self, affine: Affine, future: Self) -> Self:
        gain = backward_gain(affine, self.cov)
        moved = gain @ affine.outer.minus(future.mean, affine.predict(self.mean))
        cov = joseph(self.cov, gain, affine.matrix, affine.covariance() + future.cov)
        return type(self)(self.space.plus(self.mean, moved), cov, self.space)
