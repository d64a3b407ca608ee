"""States that are accounted for but never corrected."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..estimates import AbstractEstimate
from ..estimates.base import residual_of
from ..linalg import product, times_inverse
from ..models import AbstractModel
from .adaptation import state_rows
from .base import AbstractUpdate, Likelihood, Update


class Considered(AbstractUpdate):
    """The Schmidt-Kalman update: the named states keep their mean and variance, but their uncertainty counts.

    The optimal gain with the rows of the considered states set to zero; the Joseph form holds for any gain.

    Attributes:
        states: names of the considered states, as the covariance writes them.

    Source: Schmidt (1966), Advances in Control Systems 3:293-340.
    Reduces to: `Exact` for no states.
    """

    states: tuple[str, ...] = eqx.field(static=True, default=())

    def init(self, model: AbstractModel) -> Float[Array, " dof"]:
        rows = state_rows("states", self.states, model.space)
        return jnp.array([0.0 if i in rows else 1.0 for i in range(model.space.dof)])

    def __call__(
        self,
        carry: Float[Array, " dof"],
        prior: AbstractEstimate,
        likelihood: Likelihood,
        y: Float[Array, " output_size"],
    ) -> tuple[Float[Array, " dof"], Update]:
        affine = likelihood.affine(prior)
        _, innovation = prior.condition(affine, y, likelihood.seen)
        gain = times_inverse(product(affine.matrix, prior.cov), innovation.inverse)
        kept = gain * carry.astype(gain.dtype)[:, None]
        posterior, _ = prior.condition(affine, y, likelihood.seen, gain=kept)
        postfit = residual_of(affine, posterior.mean, y, likelihood.seen)
        weight = likelihood.seen.astype(prior.mean.dtype)
        return carry, Update(prior, posterior, innovation, affine, postfit, weight)
