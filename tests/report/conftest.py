"""Results to report on: a vehicle in the plane and a turning body."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.report import Section, figures_of
from gainful.running import Result
from gainful.spaces import quaternion_exp, quaternion_multiply, rotate

BEACONS = {"range_a": np.array([0.0, 0.0]), "range_b": np.array([60.0, 0.0]), "range_c": np.array([0.0, 60.0])}  # m


def vehicle_model() -> gf.models.Model:
    def f(x, u, t, dt):
        heading, speed = x[2], 2.0  # rad, m/s
        step = dt * jnp.array([speed * jnp.cos(heading), speed * jnp.sin(heading), 0.12 + x[3], 0.0])
        return x + step

    def range_to(beacon):
        return lambda x, u, t: jnp.sqrt(jnp.sum((x[:2] - beacon) ** 2))[None]

    return gf.discrete_model(
        f,
        states={"x": "m", "y": "m", "heading": "angle", "rate_bias": "rad/s"},
        Q=lambda x, u, t, dt: dt * jnp.diag(jnp.array([1e-2, 1e-2, 1e-4, 1e-7])),
        sensors=[gf.sensor(name, range_to(at), outputs={name: "m"}, R=0.5**2) for name, at in BEACONS.items()],
    )


def vehicle_result(rows: int = 600, *, truth: bool = True, seed: int = 0) -> Result:
    model = vehicle_model()
    prior = gf.make_prior(
        model,
        {"x": 30.0, "y": 15.0, "heading": 0.0, "rate_bias": 0.0},
        {"x": 3.0, "y": 3.0, "heading": 0.3, "rate_bias": 0.02},
    )
    log = gf.draw_log(model, prior, 0.2 * np.arange(rows), key=jax.random.key(seed))
    random = np.random.default_rng(seed)
    y = np.where(log.seen, log.y, np.nan)
    y[random.random(y.shape) < 0.03] += 15.0  # m, outliers
    y[random.random(y.shape) < 0.1] = np.nan
    y[rows // 2 : rows // 2 + rows // 10] = np.nan  # an outage
    log = gf.make_log(model, log.t, y, truth=log.truth if truth else None)
    return gf.run(gf.extended_kalman_filter(update=gf.Gated()), model, prior, log)


def attitude_result(rows: int = 400, *, truth: bool = True) -> Result:
    def reading(x, u, t):
        inverse = x[:4] * jnp.array([-1.0, -1.0, -1.0, 1.0])
        return jnp.concatenate([rotate(inverse, jnp.array(v)) for v in ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])])

    def turn(x, u, t, dt):
        rate = jnp.array([0.2, -0.1, 0.15]) + x[4:]  # rad/s
        return jnp.concatenate([quaternion_multiply(x[:4], quaternion_exp(dt * rate)), x[4:]])

    model = gf.discrete_model(
        turn,
        reading,
        states={"q": "quaternion", "bias_x": "rad/s", "bias_y": "rad/s", "bias_z": "rad/s"},
        outputs={f"{v}_{axis}": "1" for v in ("sun", "field") for axis in "xyz"},
        Q=lambda x, u, t, dt: dt * jnp.diag(jnp.array([1e-5] * 3 + [1e-9] * 3)),
        R=0.02**2 * np.ones(6),
    )
    prior = gf.make_prior(
        model,
        {"q": [0.0, 0.0, 0.0, 1.0], "bias_x": 0.0, "bias_y": 0.0, "bias_z": 0.0},
        {"q": 0.3, "bias_x": 0.01, "bias_y": 0.01, "bias_z": 0.01},
    )
    log = gf.draw_log(model, prior, 0.25 * np.arange(rows), key=jax.random.key(1))
    log = log if truth else dataclasses.replace(log, truth={})
    return gf.run(gf.extended_kalman_filter(), model, prior, log)


@functools.cache
def walk_result(rows: int, *, start: float = 0.0, names: tuple[str, str] = ("level", "flow")) -> Result:
    """A plain linear model, cheap for long records."""
    model = gf.linear_model(
        [[0.99, 0.1], [0.0, 0.9]],
        [[1.0, 0.0]],
        Q=[0.01, 0.04],
        R=0.25,
        states={names[0]: "m", names[1]: "m/s"},
        outputs={"gauge": "m"},
    )
    prior = gf.make_prior(model, [0.0, 0.0], [1.0, 1.0])
    log = gf.draw_log(model, prior, start + 0.01 * np.arange(rows), key=jax.random.key(2))
    return gf.run(gf.kalman_filter(), model, prior, log)


@pytest.fixture(scope="session")
def vehicle() -> Result:
    return vehicle_result()


@pytest.fixture(scope="session")
def smoothed(vehicle: Result) -> Result:
    return gf.smooth(vehicle)


@pytest.fixture(scope="session")
def vehicle_sections(vehicle: Result) -> list[Section]:
    return figures_of(vehicle)


@pytest.fixture(scope="session")
def attitude_sections(attitude: Result) -> list[Section]:
    return figures_of(attitude)


@pytest.fixture(scope="session")
def attitude() -> Result:
    return attitude_result()


@pytest.fixture(scope="session")
def walk() -> Callable[..., Result]:
    return walk_result
