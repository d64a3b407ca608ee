"""Measurement noise inferred together with the state."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..estimates import AbstractEstimate
from ..linalg import congruence
from ..models import AbstractModel
from .adaptation import as_predicted, remembered
from .base import AbstractUpdate, Likelihood, Update
from .exact import Exact
from .noise_factors import Factors, check_limits, check_memory, multiplied
from .reweighted import check_iterations


class InverseGamma(eqx.Module):
    """What is known of the factors on the variances of R: each inverse gamma distributed.

    Attributes:
        factors: mean factors after the last measurement, bounded.
        shape: `alpha` (m,).
        rate: `beta` (m,).
        inner: memory of the inner update.
    """

    factors: Factors
    shape: Float[Array, " m"]
    rate: Float[Array, " m"]
    inner: Any


class VariationalNoise(AbstractUpdate):
    """R that may change, inferred with the state: an inverse gamma density for each variance, in turn with the estimate.

    ```
    alpha <- rho alpha + w/2,  beta <- rho beta;  repeat: c = b / alpha;  update with sqrt(c) R sqrt(c)
    b = beta + w (postfit^2 + [H P H^T]) / (2 R)
    ```

    The innovation is told with the R expected before the measurement, so that NIS and likelihood stay predictions.
    `1 / (1 - rho)` measurements are remembered. Components that ask for more than the ceiling for `patience` measurements in a
    row are not noisy, but badly predicted, and go back to the model's R for good.

    Attributes:
        inner: the update with the noise found; its weights `w` say how much a component teaches.
        memory: `rho`, weight of the past per measurement.
        start: `alpha` at the start: the model's R counts for twice so many measurements.
        iterations: how often noise and estimate take turns.
        floor: smallest factor on a variance of the model's R.
        ceiling: largest such factor.
        patience: measurements in a row above the ceiling before the component is given up.

    Reads: the innovation. Writes: R.
    Source: Sarkka and Nummenmaa (2009), IEEE Trans. Autom. Control 54(3):596-600.
    Differs: factors on the model's variances, which keeps its correlations; bounds; a robust update inside.
    Reduces to: `inner` for `memory = 1` and an infinite `start`.

    Example:
        >>> import gainful as gf
        >>> gf.kalman_filter(update=VariationalNoise(memory=0.95)).update.start
        5.0
    """

    inner: AbstractUpdate = Exact()
    memory: float = 0.97
    start: float = 5.0
    iterations: int = eqx.field(static=True, default=5)
    floor: float = 1e-4
    ceiling: float = 100.0
    patience: int = eqx.field(static=True, default=20)

    def __check_init__(self) -> None:
        check_memory(self.memory)
        check_start(self.start)
        check_iterations(self.iterations)
        check_limits(self.floor, self.ceiling, self.patience)

    def init(self, model: AbstractModel) -> InverseGamma:
        m = model.output.dof
        known = jnp.full(m, jnp.asarray(self.start, float))
        return InverseGamma(Factors.start(m), known, known, self.inner.init(model))

    def added(
        self, carry: InverseGamma, prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"] | None:
        return self.inner.added(carry.inner, prior, process)

    def __call__(
        self, carry: InverseGamma, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[InverseGamma, Update]:
        factors, own = carry.factors, jnp.diagonal(likelihood.noise)
        safe = jnp.where(own > 0, own, jnp.inf)

        def attempt(shape: Array, rate: Array) -> tuple[tuple[Array, Array], Any, Update]:
            """The update with the noise of a density, and the density it leads to."""
            factor = jnp.where(factors.lost, 1.0, jnp.clip(rate / shape, self.floor, self.ceiling))
            noise = multiplied(likelihood.noise, factor)
            inner, update = self.inner(carry.inner, prior, eqx.tree_at(lambda part: part.noise, likelihood, noise), y)
            weight = jnp.minimum(update.weight, 1.0)
            square = update.postfit**2 + jnp.diagonal(congruence(update.affine.matrix, update.posterior.cov))
            density = (
                self.memory * carry.shape + 0.5 * weight,
                self.memory * carry.rate + 0.5 * weight * square / safe,
            )
            return tuple(part.astype(carry.shape.dtype) for part in density), inner, update  # type: ignore[return-value]

        seen = likelihood.seen
        first = (self.memory * carry.shape + 0.5 * seen, self.memory * carry.rate)
        first = tuple(part.astype(carry.shape.dtype) for part in first)
        shape, rate = jax.lax.fori_loop(1, self.iterations, lambda _, now: attempt(*now)[0], first)
        (shape, rate), inner, update = attempt(shape, rate)
        taught = seen & (update.weight > 0)
        moved = factors.moved(rate / shape, taught, self.floor, self.ceiling, self.patience)
        # A density pushed against its bounds must not go on beyond them.
        bounded = jnp.clip(rate / shape, self.floor, self.ceiling) * shape
        new = InverseGamma(
            moved,
            jnp.where(taught, shape, carry.shape),
            jnp.where(taught, bounded, carry.rate).astype(carry.rate.dtype),
            inner,
        )
        expected = likelihood.with_noise(likelihood.linearised(prior), multiplied(likelihood.noise, factors.used))
        _, nominal = prior.condition(expected, y, seen)
        return remembered(jnp.any(seen), new, carry, inner), as_predicted(update, prior, nominal)


def check_start(start: float) -> None:
    """Raise unless what is known at the start counts for something."""
    if isinstance(start, (int, float)) and not start > 0:
        raise ConfigError(f"start: expected a number above 0, got {start!r}")
