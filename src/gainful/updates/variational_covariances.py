"""Covariances of the prediction and of the measurement inferred together with the state."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError
from ..estimates import AbstractEstimate, Affine
from ..estimates.base import residual_of
from ..linalg import congruence, product, root_and_inverse, symmetrize
from ..models import AbstractModel
from .adaptation import remembered
from .base import AbstractUpdate, Likelihood, Update
from .noise_factors import Factors, check_limits, check_memory, multiplied
from .reweighted import check_iterations
from .variational_noise import check_start


class InverseWishart(eqx.Module):
    """What is known of the measurement noise, in units of the model's standard deviations.

    Attributes:
        factors: mean variances after the last measurement, bounded.
        scale: sum of squares remembered (m, m).
        count: measurements that these are worth; 0 before the first.
        extra: what the last measurement put on the prior's covariance, less what it took off (dof, dof).
        inner: none.
    """

    factors: Factors
    scale: Float[Array, "m m"]
    count: Float[Array, ""]
    extra: Float[Array, "dof dof"]
    inner: None = None


class VariationalCovariances(AbstractUpdate):
    """The prior's covariance and R, both uncertain, inferred with the state: inverse Wishart densities, in turn with it.

    ```
    repeat: P = (P_k + d d^T + tau P-) / (tau + 1),  d = x_k [-] x-
            R = (e e^T + H P_k H^T + rho U) / (rho n + 1),  e = y [-] h(x_k);  condition x- on y with P and R
    ```

    It finds wrong Q and wrong R at once as far as one measurement can tell them apart, R with its correlations. The prior's
    density begins anew at each step, around the predicted covariance. The innovation is told with what was expected
    before the measurement. Readings that are missing are completed by what is expected of them given the others.

    Attributes:
        prediction: `tau`, measurements for which the predicted covariance counts.
        memory: `rho`, weight of the past of R per measurement.
        start: measurements for which the model's R counts at the start.
        iterations: how often covariances and estimate take turns.
        floor: smallest factor on a variance of the model's R.
        ceiling: largest such factor.
        patience: measurements in a row above the ceiling before the component is given up.

    Reads: the innovation. Writes: the prior, R.
    Source: Huang, Zhang, Wu, Li and Chambers (2018), IEEE Trans. Autom. Control 63(2):594-601.
    Differs: R in units of the model's standard deviations; missing components; bounds; a smoother is told what was put
        on the prior, not what was taken off.
    Reduces to: `Exact` for `memory = 1`, an infinite `prediction` and an infinite `start`.

    Example:
        >>> import gainful as gf
        >>> gf.kalman_filter(update=VariationalCovariances()).update.prediction
        3.0
    """

    prediction: float = 3.0
    memory: float = 0.99
    start: float = 3.0
    iterations: int = eqx.field(static=True, default=8)
    floor: float = 1e-4
    ceiling: float = 100.0
    patience: int = eqx.field(static=True, default=20)

    def __check_init__(self) -> None:
        if isinstance(self.prediction, (int, float)) and not self.prediction > 0:
            raise ConfigError(f"prediction: expected a number above 0, got {self.prediction!r}")
        check_memory(self.memory)
        check_start(self.start)
        check_iterations(self.iterations)
        check_limits(self.floor, self.ceiling, self.patience)

    def init(self, model: AbstractModel) -> InverseWishart:
        m, dof = model.output.dof, model.space.dof
        return InverseWishart(Factors.start(m), jnp.eye(m), jnp.array(0.0), jnp.zeros((dof, dof)))

    def added(
        self, carry: InverseWishart, prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"]:
        size = jnp.sqrt(jnp.diagonal(prior.cov))
        unit = (
            carry.extra.astype(process.dtype) / jnp.where(size > 0, size, 1.0)[:, None] / jnp.where(size > 0, size, 1.0)
        )
        values, vectors = jnp.linalg.eigh(symmetrize(unit))
        return congruence(size[:, None] * vectors, jnp.diag(jnp.maximum(values, 0.0)))

    def __call__(
        self, carry: InverseWishart, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[InverseWishart, Update]:
        seen, linear, cov = likelihood.seen, likelihood.linearised(prior), prior.cov
        plain = linear.masked(seen)
        size = jnp.sqrt(jnp.diagonal(likelihood.noise))
        size = jnp.where(size > 0, size, 1.0)
        own = likelihood.noise / jnp.outer(size, size)
        fresh = carry.count == 0
        count = self.memory * jnp.where(fresh, self.start, carry.count)
        scale = self.memory * jnp.where(fresh, self.start * own, carry.scale.astype(own.dtype))
        expected = self._bounded(scale / count, own, carry.factors)

        def with_noise(noise: Array) -> Affine:
            return likelihood.with_noise(linear, jnp.outer(size, size) * noise)

        def covariances(mean: Array, spread: Array) -> tuple[Array, Array]:
            """Covariance of the prior and sum of squares of the noise, given an estimate."""
            moved = prior.space.minus(mean, prior.mean)
            wide = (spread + jnp.outer(moved, moved) + self.prediction * cov) / (self.prediction + 1.0)
            residual = residual_of(plain, mean, y, seen) / size
            square = jnp.outer(residual, residual) + congruence(plain.matrix / size[:, None], spread)
            return symmetrize(wide), scale + completed(square, expected, seen)

        def conditioned(wide: Array, total: Array) -> tuple[AbstractEstimate, Affine]:
            affine = with_noise(self._bounded(total / (count + 1.0), own, carry.factors))
            start = type(prior).start(prior.mean, wide, prior.space)
            return start.condition(affine, y, seen)[0], affine

        def turn(_: Any, now: tuple[Array, Array]) -> tuple[Array, Array]:
            posterior, _affine = conditioned(*covariances(*now))
            return posterior.mean, posterior.cov

        wide, total = covariances(*jax.lax.fori_loop(1, self.iterations, turn, (prior.mean, cov)))
        posterior, affine = conditioned(wide, total)
        raw, measured = jnp.diagonal(total) / (count + 1.0), jnp.any(seen)
        new = InverseWishart(
            carry.factors.moved(raw, seen, self.floor, self.ceiling, self.patience),
            self._within(total, raw),
            count + 1.0,
            wide - cov,
        )
        posterior = jax.tree.map(lambda now, then: jnp.where(measured, now, then), posterior, prior)
        _, nominal = prior.condition(with_noise(expected), y, seen)
        postfit = residual_of(affine, posterior.mean, y, seen)
        weight = jnp.asarray(seen.astype(prior.mean.dtype))
        return remembered(measured, new, carry, None), Update(prior, posterior, nominal, affine, postfit, weight)

    def _within(self, matrix: Float[Array, "m m"], variances: Float[Array, " m"]) -> Float[Array, "m m"]:
        """A matrix made larger or smaller by as much as its variances are beyond their bounds."""
        return multiplied(
            matrix, jnp.clip(variances, self.floor, self.ceiling) / jnp.where(variances > 0, variances, 1.0)
        )

    def _bounded(self, noise: Array, own: Array, factors: Factors) -> Float[Array, "m m"]:
        """The noise within its bounds, and the model's own, uncorrelated with it, for components given up."""
        lost = factors.lost
        both, some = lost[:, None] & lost[None, :], lost[:, None] | lost[None, :]
        held = self._within(noise, jnp.diagonal(noise))
        return jnp.where(both, own, jnp.where(some, 0.0, held))


def completed(square: Float[Array, "m m"], noise: Float[Array, "m m"], seen: Bool[Array, " m"]) -> Float[Array, "m m"]:
    """Squares of the seen components, with those of the others as expected given them and a covariance of the noise."""
    kept, left = jnp.diag(seen.astype(noise.dtype)), jnp.diag((~seen).astype(noise.dtype))
    _, inverse, _ = root_and_inverse(congruence(kept, noise) + left)
    regression = product(product(left, noise), product(kept, product(inverse.T, inverse)))
    regression = product(regression, kept)
    rest = congruence(left, noise) - product(product(regression, noise), left)
    return congruence(kept + regression, square) + symmetrize(rest)
