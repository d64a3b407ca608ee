"""Noise scaled within the step until it explains the innovations."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate
from ..linalg import chi_square_quantile, congruence, product, root_and_inverse, times_inverse
from ..models import AbstractModel
from .adaptation import (
    as_predicted,
    check_bounds,
    excess,
    inflated,
    remembered,
    ridge_of,
    solve_least_squares,
    with_inner,
)
from .base import AbstractUpdate, Likelihood, Update
from .exact import Exact

CHANNELS = ("measurement", "state", "bias")


class Scaling(eqx.Module):
    """What the scaling remembers.

    Attributes:
        residuals: the last innovations, newest last (window, m).
        nis: their normalised squares (window,).
        degrees: how many components each had (window,).
        count: how many innovations there have been.
        process: factor on the variance of each degree of freedom's process noise at the last measurement (dof,).
        measurement: factor on the variance of each component's measurement noise then (m,).
        ridge: inverse squares of the largest biases that are possible (added,).
        inner: memory of the inner update.
    """

    residuals: Float[Array, "window m"]
    nis: Float[Array, " window"]
    degrees: Int[Array, " window"]
    count: Int[Array, ""]
    process: Float[Array, " dof"]
    measurement: Float[Array, " m"]
    ridge: Float[Array, " added"]
    inner: Any


class InnovationScaling(AbstractUpdate):
    """Scales R and Q within the step when the innovations of a window are larger than they should be.

    With the window's `C = mean r r^T`, the nominal covariance `S` and what is unexplained, `E = C - S`:

    ```
    measurement  s_i = 1 + [E R^-1]_ii           R <- R + (s - 1)^1/2 R (s - 1)^1/2
    state        s_i = 1 + [G E G^T]_ii / Q_ii,  G a left inverse of Hx
    bias         s_i = 1 + [G E G^T]_ii / Q_ii,  G = (N^T S^-1 N + diag(b_max^-2))^-1 N^T S^-1,  N = Hx V + Hb
    ```

    each at least 1 and at most `cap`, one channel after the other, each taking what it explains off `E`. The noise is
    added to the prior and the measurement used once. The default acts on the biases, then the states, and only when the
    window's squared innovations exceed a chi-square limit. A filter told of too small an R takes that for a fault.

    Attributes:
        inner: the update with the scaled noise.
        order: channels, of "measurement", "state" and "bias", in the order they are credited.
        window: innovations averaged.
        gate: share of sound windows that would be acted on; 1 acts always, 0 never.
        bounds: largest size of a bias that is possible, by the name of its state; keeps the factors finite where the
            bias cannot be seen.
        cap: largest factor.
        weighted: left inverses weighted by `S^-1` as above; plain ones if not.

    Reads: the innovation. Writes: the prior, R.
    Source: Hajiyev and Soken (2013), Aerosp. Sci. Technol. 28(1):376-383; Chen et al. (2019), Acta Aeronaut. Astronaut.
        Sin. 40(5):322551 for the two-stage form.
    Differs: weighted and bounded left inverses; a gate; the noise added is a covariance even where Q is not diagonal.
    Reduces to: `inner` for `gate = 0`.
    """

    inner: AbstractUpdate = Exact()
    order: tuple[str, ...] = eqx.field(static=True, default=("bias", "state"))
    window: int = eqx.field(static=True, default=10)
    gate: float = eqx.field(static=True, default=1e-4)
    bounds: dict[str, float] = eqx.field(default_factory=dict)
    cap: float = eqx.field(static=True, default=1e13)
    weighted: bool = eqx.field(static=True, default=True)

    def __check_init__(self) -> None:
        for channel in self.order:
            if channel not in CHANNELS:
                raise ConfigError(f"order: {channel!r} is not a channel; {did_you_mean(str(channel), CHANNELS)}")
        if len(set(self.order)) != len(self.order) or not self.order:
            raise ConfigError(f"order: expected one or more channels, each once, got {list(self.order)}")
        if not isinstance(self.window, int) or self.window < 1:
            raise ConfigError(f"window: expected a whole number of at least 1, got {self.window!r}")
        if not 0 <= self.gate <= 1:
            raise ConfigError(f"gate: expected a number from 0 to 1, got {self.gate!r}")
        if not self.cap >= 1:
            raise ConfigError(f"cap: expected a number of at least 1, got {self.cap!r}")
        check_bounds(self.bounds)

    def init(self, model: AbstractModel) -> Scaling:
        space, m = model.space, model.output.dof
        return Scaling(
            residuals=jnp.zeros((self.window, m)),
            nis=jnp.zeros(self.window),
            degrees=jnp.zeros(self.window, int),
            count=jnp.array(0),
            process=jnp.ones(space.dof),
            measurement=jnp.ones(m),
            ridge=ridge_of(self.bounds, space),
            inner=self.inner.init(model),
        )

    def added(
        self, carry: Scaling, prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"]:
        extra = excess(carry.process.astype(process.dtype), process)
        return with_inner(extra, self.inner, carry.inner, prior, process)

    def reported(self, carry: Scaling, estimate: AbstractEstimate) -> AbstractEstimate:
        return self.inner.reported(carry.inner, estimate)

    def __call__(
        self, carry: Scaling, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[Scaling, Update]:
        affine = likelihood.affine(prior)
        _, nominal = prior.condition(affine, y, likelihood.seen)
        measured = jnp.any(likelihood.seen)

        def newest(values: Array, value: Array) -> Array:
            return jnp.concatenate([values[1:], value[None].astype(values.dtype)])

        residuals, nis = newest(carry.residuals, nominal.residual), newest(carry.nis, nominal.nis)
        degrees, count = newest(carry.degrees, jnp.sum(likelihood.seen)), carry.count + 1
        limits = jnp.asarray(chi_square_quantile(1.0 - self.gate, self.window * likelihood.seen.size))
        acting = measured & (count >= self.window) & (jnp.sum(nis) > limits[jnp.sum(degrees)])
        if self.gate == 1.0:
            acting = measured
        sample = product(residuals.T, residuals) / jnp.minimum(count, self.window)
        process, measurement = self._factors(
            sample.astype(affine.matrix.dtype) - nominal.cov, affine.matrix, nominal.cov, prior, likelihood, carry.ridge
        )
        process, measurement = jnp.where(acting, process, 1.0), jnp.where(acting, measurement, 1.0)
        extra = excess(process.astype(likelihood.process.dtype), likelihood.process)
        noise = likelihood.noise + excess(measurement.astype(likelihood.noise.dtype), likelihood.noise)
        scaled = eqx.tree_at(lambda part: part.noise, likelihood, noise)
        inner, update = self.inner(carry.inner, inflated(prior, extra, jnp.any(process > 1.0)), scaled, y)
        new = Scaling(residuals, nis, degrees, count, process, measurement, carry.ridge, inner)
        return remembered(measured, new, carry, inner), as_predicted(update, prior, nominal)

    def _factors(
        self,
        unexplained: Array,
        matrix: Array,
        spread: Array,
        prior: AbstractEstimate,
        likelihood: Likelihood,
        ridge: Array,
    ) -> tuple[Float[Array, " dof"], Float[Array, " m"]]:
        """Factors on Q and R that explain `unexplained`, channel by channel."""
        dof, n = prior.space.dof, prior.space.dof - prior.space.added
        process, measurement = jnp.ones(dof, matrix.dtype), jnp.ones(matrix.shape[0], matrix.dtype)
        _, whiten, _ = root_and_inverse(spread)
        precise = product(whiten.T, whiten) if self.weighted else jnp.eye(len(spread), dtype=spread.dtype)
        cov = prior.cov
        _, inverse, _ = root_and_inverse(cov[n:, n:])
        coupling = times_inverse(cov[n:, :n], inverse)
        ways = {
            "state": (matrix[:, :n], slice(0, n), jnp.zeros(n, matrix.dtype)),
            "bias": (product(matrix[:, :n], coupling) + matrix[:, n:], slice(n, dof), ridge.astype(matrix.dtype)),
        }
        for channel in self.order:
            if channel == "measurement":
                _, root, _ = root_and_inverse(likelihood.noise)
                share = jnp.diagonal(product(product(unexplained, root.T), root))
                measurement = jnp.clip(1.0 + jnp.where(likelihood.seen, share, 0.0), 1.0, self.cap)
                unexplained = unexplained - excess(measurement, likelihood.noise)
                continue
            way, block, penalty = ways[channel]
            noise = likelihood.process[block, block]
            inverse_map = solve_least_squares(way, precise, penalty)
            variances = jnp.diagonal(noise)
            wanted = jnp.diagonal(congruence(inverse_map, unexplained))
            share = jnp.where(variances > 0, wanted / jnp.where(variances > 0, variances, 1.0), 0.0)
            factors = jnp.clip(1.0 + jnp.nan_to_num(share), 1.0, self.cap)
            process = process.at[block].set(factors)
            unexplained = unexplained - congruence(way, excess(factors, noise))
        return process, measurement
