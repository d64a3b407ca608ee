"""Records drawn from a model."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..errors import ModelError, ShapeError
from ..estimates import AbstractEstimate
from ..linalg import root
from ..models import AbstractModel, Instant
from .disturbances import AbstractDisturbance
from .log import Log, make_log


def draw_log(
    model: AbstractModel,
    prior: AbstractEstimate,
    t: Any,
    u: Any = None,
    *,
    key: Array,
    process: AbstractDisturbance | None = None,
    measurement: AbstractDisturbance | None = None,
) -> Log:
    """A record as the model would produce it, with its truth: initial state from the prior, noise from Q and R.

    Args:
        model: of the plant.
        prior: where the true initial state is drawn from, at the first time.
        t: times [s] (T,).
        u: inputs (T, inputs).
        key: random key; the same key gives the same record.
        process: law of the process noise, with Q as its nominal part; Gaussian by default.
        measurement: law of the measurement noise, with R as its nominal part; Gaussian by default.

    Example:
        >>> from gainful.models import linear_model
        >>> from gainful.running import GaussianMixture, make_prior
        >>> model = linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> prior = make_prior(model, [0.0], [1.0])
        >>> len(draw_log(model, prior, np.arange(9.0), key=jax.random.key(0), measurement=GaussianMixture(0.1, 10.0)))
        9
    """
    times = np.asarray(t, dtype=float)
    if times.ndim != 1 or not len(times):
        raise ModelError(f"t: expected a vector of times, got shape {times.shape}")
    inputs = np.zeros((len(times), len(model.inputs))) if u is None else np.asarray(u, dtype=float)
    if inputs.shape != (len(times), len(model.inputs)):
        raise ShapeError(f"u: expected shape ({len(times)}, {len(model.inputs)}), got {inputs.shape}")
    moments = Instant(jnp.asarray(times), jnp.asarray(np.diff(times, prepend=times[0])), jnp.asarray(inputs))
    states, measured = jax.jit(lambda moments, key: draw(model, prior, moments, key, process, measurement))(
        moments, key
    )
    truth = {name: np.asarray(states[:, i]) for i, name in enumerate(model.space.names)}
    return make_log(model, times, np.asarray(measured), inputs, truth=truth)


def draw(
    model: AbstractModel,
    prior: AbstractEstimate,
    moments: Instant,
    key: Array,
    process: AbstractDisturbance | None = None,
    measurement: AbstractDisturbance | None = None,
) -> tuple[Array, Array]:
    """States and measurements at stacked moments: pure, so `vmap` over keys applies."""
    start_key, key = jax.random.split(key)
    normal = jax.random.normal(start_key, (model.space.dof,), prior.mean.dtype)
    start = model.space.plus(prior.mean, prior.factor @ normal)
    keys = jax.vmap(jax.random.split)(jax.random.split(key, moments.t.shape[0]))

    def unit(law: AbstractDisturbance | None, keys: Array, dof: int) -> Array:
        if law is None:
            return jax.vmap(lambda own: jax.random.normal(own, (dof,), start.dtype))(keys)
        return law.draw(keys[0], moments.t.shape[0], jnp.ones(dof)).astype(start.dtype)

    def step(x: Array, given: tuple[Instant, Array, Array]) -> tuple[Array, tuple[Array, Array]]:
        when, w, v = given
        moving, _ = root(model.process_noise(x, when))
        x = model.space.plus(model.transition(x, when), moving @ w)
        reading, _ = root(model.measurement_noise(x, when))
        return x, (x, model.output.plus(model.observe(x, when), reading @ v))

    given = unit(process, keys[:, 0], model.space.dof), unit(measurement, keys[:, 1], model.output.dof)
    _, drawn = jax.lax.scan(step, start, (moments, *given))
    return drawn
