"""The small plant the checks use: an input, an angle, two sensors, one of them curved and with two outputs.

A cart drives at the commanded speed along a heading that drifts. A beacon reads where it is, a compass its heading.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from ..estimates import Gaussian
from ..models import AbstractModel, Instant, Model, Sample, discrete_model, sensor
from ..spaces import AbstractSpace
from .spaces import point_of

HEADING = 3.1  # rad; near the cut at pi, so that wrapping is part of every check
POSITION_VARIANCE, HEADING_VARIANCE, COVARIANCE = 0.09, 0.04, 0.02  # m^2, rad^2, m rad


def _drive(x: Array, u: Array, t: Array, dt: Array) -> Array:
    return jnp.stack([x[0] + dt * u[0] * jnp.cos(x[1]), x[1] + 0.2 * dt])


def _spread(x: Array, u: Array, t: Array, dt: Array) -> Array:
    return dt * jnp.array([[0.05, 0.0], [0.0, 0.02]], x.dtype)


def _beacon(x: Array) -> Array:
    return jnp.stack([x[0] + 0.1 * x[0] ** 2, x[0] * jnp.cos(0.5 * x[1])])


def _along(x: Array) -> Array:
    return _beacon(x)[:1]


def _compass(x: Array) -> Array:
    return x[1:]


def cart_model(*, across: bool = True) -> Model:
    """The cart, the same object in value at every call; without `across` the beacon has one output, to compile faster."""
    both = ({"along": "m", "across": "m"}, [[0.04, 0.01], [0.01, 0.03]])
    outputs, noise = both if across else ({"along": "m"}, 0.04)
    return discrete_model(
        _drive,
        states={"x": "m", "heading": "angle"},
        inputs={"speed": "m/s"},
        Q=_spread,
        sensors=[
            sensor("beacon", _beacon if across else _along, outputs=outputs, R=noise),
            sensor("compass", _compass, outputs={"compass": "angle"}, R=0.01),
        ],
    )


def cart_prior() -> Gaussian:
    """Where the cart starts, correlated and across the cut of its heading."""
    cov = jnp.array([[POSITION_VARIANCE, COVARIANCE], [COVARIANCE, HEADING_VARIANCE]])
    return Gaussian.start(jnp.array([1.0, HEADING]), cov, cart_model().space)


def any_prior(model: AbstractModel) -> Gaussian:
    """A prior for a model about which nothing is known: some point, with a tenth of each tangent unit."""
    space: AbstractSpace = model.space
    return Gaussian.start(point_of(space), 0.01 * jnp.eye(space.dof), space)


def instant(model: AbstractModel, t: float = 0.5, dt: float = 0.1) -> Instant:
    """A moment with all inputs at one half."""
    return Instant(jnp.asarray(t), jnp.asarray(dt), jnp.full(len(model.inputs), 0.5))


def reading(model: AbstractModel, x: Array, when: Instant, key: Array, *, sigmas: float = 1.0) -> Array:
    """A measurement at a state, with noise of `sigmas` times the model's own deviations."""
    deviations = jnp.sqrt(jnp.diagonal(model.measurement_noise(x, when)))
    noise = sigmas * deviations * jax.random.normal(key, deviations.shape)
    return model.output.plus(model.observe(x, when), noise)


def record(model: AbstractModel, x: Array, key: Array) -> Sample:
    """Five stacked samples: all seen, some, none, none at the same moment once more, all after a longer step."""
    steps = jnp.array([0.0, 0.1, 0.1, 0.0, 0.2])
    rows, width = len(steps), model.output.dof
    seen: Bool[Array, "rows width"] = jnp.ones((rows, width), bool)
    seen = seen.at[1, : (width + 1) // 2].set(False).at[2:4].set(False)
    moments = Instant(jnp.cumsum(steps), steps, jnp.full((rows, len(model.inputs)), 0.5))
    y = [reading(model, x, instant(model), k) for k in jax.random.split(key, rows)]
    return Sample(moments, jnp.stack(y), seen)
