"""What updates that weigh each measurement by its own residual have in common."""

import abc
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..estimates import AbstractEstimate, Affine
from ..estimates.base import residual_of
from ..linalg import congruence, product, root_and_inverse
from ..models import AbstractModel
from .base import AbstractUpdate, Likelihood, Update


class Residuals(eqx.Module):
    """How far an estimate is from what was measured and from what was predicted.

    Attributes:
        measured: measured minus expected, in uncorrelated units of R (m,).
        spread: variance of the expectation in the same units (m,).
        moved: estimate minus prediction, in uncorrelated units of its covariance (dof,).
        count: components seen.
    """

    measured: Float[Array, " m"]
    spread: Float[Array, " m"]
    moved: Float[Array, " dof"]
    count: Array


class AbstractReweighted(AbstractUpdate):
    """An exact update in which a component of weight `w` has the noise `R / w`; weights and estimate take turns.

    ```
    w = weigh(residuals of the prediction);  repeat: estimate with R_w = L diag(1/w) L^T;  w = weigh(its residuals)
    ```

    `L` is the Cholesky root of R, so that weights belong to sensors where R is diagonal.
    """

    @property
    @abc.abstractmethod
    def iterations(self) -> int:
        """How often the weights are found, at least 1."""

    @abc.abstractmethod
    def weigh(self, residuals: Residuals) -> tuple[Float[Array, " m"], Float[Array, " dof"] | None]:
        """Weights of the measurement, and of the prediction if it may be wrong too."""

    def conclude(
        self, prior: AbstractEstimate, weighted: AbstractEstimate, affine: Affine, scaled: Affine, y: Array, seen: Array
    ) -> AbstractEstimate:
        """The posterior, given the prediction and the map, both as they are and with their weights."""
        return weighted.condition(scaled, y, seen)[0]

    def init(self, model: AbstractModel) -> Any:
        return jnp.ones(model.space.dof)

    def added(
        self, carry: Any, prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"] | None:
        return _doubt(prior, carry.astype(process.dtype))

    def __call__(
        self, carry: Any, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[Any, Update]:
        seen, plain = likelihood.seen, likelihood.linearised(prior)
        affine = likelihood.with_noise(plain, likelihood.noise)
        _, innovation = prior.condition(affine, y, seen)
        lower, inverse, _ = root_and_inverse(affine.noise)
        _, unmove = prior.roots
        matrix = product(inverse, affine.matrix)

        def weights(estimate: AbstractEstimate) -> tuple[Array, Array]:
            residuals = Residuals(
                inverse @ residual_of(affine, estimate.mean, y, seen),
                jnp.diagonal(congruence(matrix, estimate.cov)),
                unmove @ prior.space.minus(estimate.mean, prior.mean),
                jnp.sum(seen),
            )
            found, doubted = self.weigh(residuals)
            trust = jnp.ones_like(residuals.moved) if doubted is None else doubted
            return jnp.where(seen, found, 1.0), jnp.where(jnp.any(seen), trust, 1.0)

        def weighted(found: tuple[Array, Array]) -> tuple[AbstractEstimate, Affine]:
            noise = congruence(lower, jnp.diag(1.0 / found[0]))
            return prior.plus_noise(_doubt(prior, found[1])), likelihood.with_noise(plain, noise)

        def refine(_: Any, found: tuple[Array, Array]) -> tuple[Array, Array]:
            inflated, scaled = weighted(found)
            return weights(inflated.condition(scaled, y, seen)[0])

        found = jax.lax.fori_loop(1, self.iterations, refine, weights(prior))
        inflated, scaled = weighted(found)
        posterior = self.conclude(prior, inflated, affine, scaled, y, seen)
        postfit = residual_of(affine, posterior.mean, y, seen)
        weight = jnp.where(seen, found[0], 0.0).astype(prior.mean.dtype)
        return found[1].astype(carry.dtype), Update(prior, posterior, innovation, affine, postfit, weight)


def check_iterations(iterations: object) -> None:
    """Raise unless a number of iterations is a whole number of at least 1."""
    if not isinstance(iterations, int) or iterations < 1:
        raise ConfigError(f"iterations: expected a whole number of at least 1, got {iterations!r}")


def _doubt(prior: AbstractEstimate, trust: Float[Array, " dof"]) -> Float[Array, "dof dof"]:
    """Covariance that a prediction of weights `trust` lacks: `L diag(1/w - 1) L^T`."""
    return congruence(prior.roots[0], jnp.diag(1.0 / trust - 1.0))
