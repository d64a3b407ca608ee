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
from .log import Log, make_log


def draw_log(model: AbstractModel, prior: AbstractEstimate, t: Any, u: Any = None, *, key: Array) -> Log:
    """A record as the model would produce it, with its truth: initial state from the prior, noise from Q and R.

    Args:
        model: of the plant.
        prior: where the true initial state is drawn from, at the first time.
        t: times [s] (T,).
        u: inputs (T, inputs).
        key: random key; the same key gives the same record.
    """
    times = np.asarray(t, dtype=float)
    if times.ndim != 1 or not len(times):
        raise ModelError(f"t: expected a vector of times, got shape {times.shape}")
    inputs = np.zeros((len(times), len(model.inputs))) if u is None else np.asarray(u, dtype=float)
    if inputs.shape != (len(times), len(model.inputs)):
        raise ShapeError(f"u: expected shape ({len(times)}, {len(model.inputs)}), got {inputs.shape}")
    moments = Instant(jnp.asarray(times), jnp.asarray(np.diff(times, prepend=times[0])), jnp.asarray(inputs))
    states, measured = jax.jit(lambda moments, key: draw(model, prior, moments, key))(moments, key)
    truth = {name: np.asarray(states[:, i]) for i, name in enumerate(model.space.names)}
    return make_log(model, times, np.asarray(measured), inputs, truth=truth)


def draw(model: AbstractModel, prior: AbstractEstimate, moments: Instant, key: Array) -> tuple[Array, Array]:
    """States and measurements at stacked moments: pure, so `vmap` over keys applies."""
    start_key, key = jax.random.split(key)
    normal = jax.random.normal(start_key, (model.space.dof,), prior.mean.dtype)
    start = model.space.plus(prior.mean, prior.factor @ normal)

    def step(x: Array, given: tuple[Instant, Array]) -> tuple[Array, tuple[Array, Array]]:
        when, own = given
        first, second = jax.random.split(own)
        process, _ = root(model.process_noise(x, when))
        x = model.space.plus(model.transition(x, when), process @ jax.random.normal(first, (model.space.dof,), x.dtype))
        noise, _ = root(model.measurement_noise(x, when))
        v = noise @ jax.random.normal(second, (model.output.dof,), x.dtype)
        return x, (x, model.output.plus(model.observe(x, when), v))

    _, drawn = jax.lax.scan(step, start, (moments, jax.random.split(key, moments.t.shape[0])))
    return drawn
