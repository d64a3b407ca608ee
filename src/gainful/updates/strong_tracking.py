"""A fading factor that keeps the innovations as large as predicted."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..estimates import AbstractEstimate
from ..linalg import congruence, product, root_and_inverse, symmetrize
from ..models import AbstractModel
from .adaptation import as_predicted, inflated, remembered, with_inner
from .base import AbstractUpdate, Likelihood, Update
from .exact import Exact


class Fading(eqx.Module):
    """What strong tracking remembers.

    Attributes:
        spread: running covariance of the innovations (m, m).
        started: 1 once there has been an innovation.
        factor: fading factor at the last measurement.
        inner: memory of the inner update.
    """

    spread: Float[Array, "m m"]
    started: Float[Array, ""]
    factor: Float[Array, ""]
    inner: Any


class StrongTracking(AbstractUpdate):
    """Multiplies what the last estimate contributed to the prior, `A P A^T`, by a factor of at least 1.

    ```
    V <- (rho V + r r^T) / (1 + rho);  factor = tr(V - H Q H^T - beta R) / tr(H A P A^T H^T), traces in units of R
    ```

    Attributes:
        inner: the update of the inflated prior.
        memory: `rho`, weight of the past innovations, from 0 to 1.
        softening: `beta`, at least 1; more makes the factor rarer.
        cap: largest factor.

    Reads: the innovation. Writes: the prior.
    Source: Zhou and Frank (1996), Int. J. Control 65(2):295-307.
    Differs: traces in units of R, so that units of the outputs do not matter; a cap.
    Reduces to: `inner` for `cap = 1`.
    """

    inner: AbstractUpdate = Exact()
    memory: float = 0.95
    softening: float = 4.0
    cap: float = 1e6

    def __check_init__(self) -> None:
        if not 0 <= self.memory <= 1:
            raise ConfigError(f"memory: expected a number from 0 to 1, got {self.memory!r}")
        if not self.softening >= 1:
            raise ConfigError(f"softening: expected a number of at least 1, got {self.softening!r}")
        if not self.cap >= 1:
            raise ConfigError(f"cap: expected a number of at least 1, got {self.cap!r}")

    def init(self, model: AbstractModel) -> Fading:
        m = model.output.dof
        return Fading(jnp.zeros((m, m)), jnp.array(0.0), jnp.array(1.0), self.inner.init(model))

    def added(
        self, carry: Fading, prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"]:
        extra = (carry.factor - 1.0).astype(process.dtype) * _carried(prior, process)
        return with_inner(extra, self.inner, carry.inner, prior, process)

    def reported(self, carry: Fading, estimate: AbstractEstimate) -> AbstractEstimate:
        return self.inner.reported(carry.inner, estimate)

    def __call__(
        self, carry: Fading, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[Fading, Update]:
        affine = likelihood.affine(prior)
        _, nominal = prior.condition(affine, y, likelihood.seen)
        measured, process = jnp.any(likelihood.seen), likelihood.process
        square = jnp.outer(nominal.residual, nominal.residual)
        past = self.memory * carry.started
        spread = (past * carry.spread + square) / (1.0 + past)
        _, whiten, _ = root_and_inverse(likelihood.noise)
        whiten = jnp.where(likelihood.seen, whiten, 0.0)  # components not seen add nothing to the traces
        explained = congruence(affine.matrix, process) + self.softening * likelihood.noise
        wanted = jnp.trace(congruence(whiten, spread.astype(whiten.dtype) - explained))
        carried = _carried(prior, process)
        there = jnp.trace(congruence(product(whiten, affine.matrix), carried))
        factor = jnp.clip(wanted / jnp.where(there > 0, there, jnp.inf), 1.0, self.cap)
        factor = jnp.where(measured, factor, 1.0)
        inner, update = self.inner(carry.inner, inflated(prior, (factor - 1.0) * carried, factor > 1.0), likelihood, y)
        new = Fading(spread, jnp.array(1.0), factor, inner)
        return remembered(measured, new, carry, inner), as_predicted(update, prior, nominal)


def _carried(prior: AbstractEstimate, process: Array) -> Float[Array, "dof dof"]:
    """`A P A^T`: the part of the prior that is not the interval's noise."""
    return symmetrize(prior.cov - process)
