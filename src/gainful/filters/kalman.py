"""The one filter."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import Status
from ..estimates import AbstractEstimate, Affine, Gaussian
from ..linearization import AbstractLinearization, Taylor
from ..models import AbstractModel, Sample
from ..noise import AbstractNoise, Nominal
from ..updates import AbstractUpdate, Exact, Likelihood, Update
from .base import AbstractEstimator, Info, is_finite, step_status


class Carry(eqx.Module):
    """What a filter remembers: its estimate and the memory of its parts."""

    estimate: AbstractEstimate
    update: Any
    noise: Any


class KalmanFilter(AbstractEstimator):
    """Predict over the interval, then update with what was measured at its end.

    A choice of four parts; every named filter is one.

    Attributes:
        linearization: of the transition and, unless told otherwise, of the measurement.
        update: how strongly a measurement counts.
        noise: what Q and R are now.
        estimate: the coordinates of the estimate, `Gaussian` or `SquareRoot`.

    A step whose prediction or update is not finite, or whose innovation covariance is not positive definite, keeps the
    last good estimate and says so in its status.

    Example:
        >>> from gainful.linearization import SigmaPoints
        >>> KalmanFilter(linearization=SigmaPoints()).estimate.__name__
        'Gaussian'
    """

    linearization: AbstractLinearization = Taylor()
    update: AbstractUpdate = Exact()
    noise: AbstractNoise = Nominal()
    estimate: type[AbstractEstimate] = eqx.field(static=True, default=Gaussian)

    def init(self, model: AbstractModel, prior: AbstractEstimate) -> Carry:
        start = self.estimate.start(prior.mean, prior.cov, model.space)
        return Carry(start, self.update.init(model), self.noise.init(model))

    def predict(self, model: AbstractModel, carry: Carry, sample: Sample) -> AbstractEstimate:
        """The estimate at the end of the interval, before its measurement."""
        return carry.estimate.push(self.transition_map(model, carry, sample))

    def transition_map(self, model: AbstractModel, carry: Carry, sample: Sample) -> Affine:
        """The affine map that leads from the last estimate to the prediction, with the process noise of the interval."""
        return self._map(model, carry, sample).plus_noise(self.process_noise(model, carry, sample))

    def process_noise(self, model: AbstractModel, carry: Carry, sample: Sample) -> Float[Array, "dof dof"]:
        """The covariance the interval adds, as the noise law has it."""
        return self.noise.process(carry.noise, model.process_noise(carry.estimate.mean, sample.when))

    def _map(self, model: AbstractModel, carry: Carry, sample: Sample) -> Affine:
        return self.linearization(lambda x: model.transition(x, sample.when), carry.estimate, model.space)

    def step(self, model: AbstractModel, carry: Carry, sample: Sample) -> tuple[Carry, Info]:
        return self.advance(model, carry, sample)[:2]

    def advance(self, model: AbstractModel, carry: Carry, sample: Sample) -> tuple[Carry, Info, Update]:
        """A step, and what its update did."""
        when, last = sample.when, carry.estimate
        process = self.process_noise(model, carry, sample)
        transition = self._map(model, carry, sample)
        moved = last.push(transition.plus_noise(process))
        # Without an interval the prediction is the estimate itself, to the last bit.
        prior = jax.tree.map(lambda new, old: jnp.where(when.dt > 0, new, old), moved, last)
        noise = self.noise.measurement(carry.noise, model.measurement_noise(prior.mean, when))
        likelihood = Likelihood(
            lambda x: model.observe(x, when),
            model.output,
            noise,
            sample.seen,
            process,
            model.sensors,
            self.linearization,
            when=when,
            transition=transition,
        )
        memory, update = self.update(carry.update, prior, likelihood, sample.y)
        innovation, posterior = update.innovation, update.posterior
        predicted = is_finite(prior)
        usable = innovation.positive & predicted & is_finite(posterior)
        measured = jnp.any(sample.seen)
        estimate = jax.tree.map(
            lambda new, middle, old: jnp.where(usable & measured, new, jnp.where(predicted, middle, old)),
            posterior,
            prior,
            last,
        )
        judged = step_status(measured, innovation, usable, jnp.any(update.weight > 0))
        status = jnp.where(predicted, judged, Status.nonfinite).astype(jnp.int32)
        learned = jax.tree.map(
            lambda new, old: jnp.where(usable, new, old),
            (memory, self.noise.learn(carry.noise, update)),
            (carry.update, carry.noise),
        )
        told = self.update.reported(learned[0], estimate)
        if told is not estimate:
            # After a step that could not be used the memory is an older one, and says nothing of this estimate.
            told = jax.tree.map(lambda new, old: jnp.where(usable, new, old), told, estimate)
        info = Info.of(told, learned, innovation, update.weight, status)
        return Carry(estimate, *learned), info, update
