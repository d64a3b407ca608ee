"""The contract of an estimate."""

import abc
from typing import Self

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..linalg import gaussian_log_density, product, root_and_inverse, symmetrize, times_inverse
from ..spaces import AbstractSpace
from .affine import Affine


class Innovation(eqx.Module):
    """How a measurement differed from what was expected, and how much it was expected to.

    Attributes:
        residual: measured minus expected, zero where unseen (m,).
        cov: its covariance (m, m).
        lower: root of the covariance (m, m).
        inverse: inverse of the root, which whitens (m, m).
        seen: which components count (m,).
        positive: whether the covariance is positive definite.
    """

    residual: Float[Array, " m"]
    cov: Float[Array, "m m"]
    lower: Float[Array, "m m"]
    inverse: Float[Array, "m m"]
    seen: Bool[Array, " m"]
    positive: Bool[Array, ""]

    @property
    def whitened(self) -> Float[Array, " m"]:
        """The residual in uncorrelated units of one sigma (m,)."""
        return self.inverse @ self.residual

    @property
    def nis(self) -> Float[Array, ""]:
        """Normalised innovation squared, chi-square with as many degrees as components seen."""
        return jnp.sum(self.whitened**2)

    @property
    def log_likelihood(self) -> Float[Array, ""]:
        """Log density of the measurement under the prediction; 0 where nothing was seen."""
        return gaussian_log_density(self.whitened, self.lower, jnp.sum(self.seen))


class AbstractEstimate(eqx.Module):
    """A state with its uncertainty: what the one linear-Gaussian algebra needs of it.

    Attributes:
        mean: a point of the space (size,).
        cov: covariance in tangent coordinates (dof, dof).
        factor: lower-triangular root of the covariance (dof, dof).
        space: where the state lives.
    """

    mean: eqx.AbstractVar[Float[Array, " size"]]
    cov: eqx.AbstractVar[Float[Array, "dof dof"]]
    factor: eqx.AbstractVar[Float[Array, "dof dof"]]
    space: eqx.AbstractVar[AbstractSpace]

    @classmethod
    @abc.abstractmethod
    def start(cls, mean: Float[Array, " size"], cov: Float[Array, "dof dof"], space: AbstractSpace) -> Self:
        """The estimate with this mean and covariance."""

    @property
    @abc.abstractmethod
    def roots(self) -> tuple[Float[Array, "dof dof"], Float[Array, "dof dof"]]:
        """The lower-triangular root of the covariance and its inverse, with zero rows where the root is singular."""

    @abc.abstractmethod
    def push(self, affine: Affine) -> Self:
        """The estimate of `y` for `y = affine(x)`."""

    @abc.abstractmethod
    def condition(
        self,
        affine: Affine,
        y: Float[Array, " out_size"],
        seen: Bool[Array, " out"],
        *,
        gain: Float[Array, "dof out"] | None = None,
    ) -> tuple[Self, Innovation]:
        """The estimate given `y = affine(x)`, by the optimal gain or by the one given."""

    @abc.abstractmethod
    def plus_noise(self, cov: Float[Array, "dof dof"]) -> Self:
        """The estimate with covariance added."""

    @abc.abstractmethod
    def revise(self, affine: Affine, future: Self) -> Self:
        """The estimate of `x` given the smoothed estimate of `y = affine(x)` (one Rauch-Tung-Striebel step)."""


def backward_gain(affine: Affine, cov: Float[Array, "in in"]) -> Float[Array, "in out"]:
    """`P A^T (A P A^T + N)^-1`: how much of a correction of `y = affine(x)` belongs to `x`."""
    cross = product(affine.matrix, cov)
    _, inverse, _ = root_and_inverse(symmetrize(product(cross, affine.matrix.T) + affine.covariance()))
    return times_inverse(cross, inverse)


def residual_of(
    affine: Affine, mean: Float[Array, " size"], y: Float[Array, " out_size"], seen: Bool[Array, " out"]
) -> Float[Array, " out"]:
    """Measured minus expected, zero where unseen."""
    return jnp.where(seen, affine.outer.minus(y, affine.predict(mean)), 0.0)
