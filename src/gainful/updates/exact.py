"""Bayes' rule for the linearised measurement."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..estimates import AbstractEstimate
from ..estimates.base import residual_of
from ..models import AbstractModel
from .base import AbstractUpdate, Likelihood, Update


class Exact(AbstractUpdate):
    """The Kalman update: every measured component counts in full.

    Source: Kalman (1960), J. Basic Eng. 82(1):35-45.
    """

    def init(self, model: AbstractModel) -> None:
        return None

    def __call__(
        self, carry: None, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[None, Update]:
        affine = likelihood.affine(prior)
        posterior, innovation = prior.condition(affine, y, likelihood.seen)
        postfit = residual_of(affine, posterior.mean, y, likelihood.seen)
        weight = likelihood.seen.astype(prior.mean.dtype)
        return None, Update(prior, posterior, innovation, affine, postfit, jnp.asarray(weight))
