"""A sensor's repeatable error is learned while something better tells, and taken off wherever it was seen."""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.aiding import SensorMap, SensorMapReport
from gainful.models import Instant
from gainful.networks import CMACTraining, PerceptronTraining

from .track import TRUTH, prior, track_model, tracks

MODEL, FILTER = track_model(TRUTH), gf.kalman_filter()
WHEN = Instant(jnp.array(0.0), jnp.array(1.0), jnp.zeros(0))
FINE = CMACTraining(levels=128, layers=8, compress="none", epochs=2)


def deviation(x: np.ndarray) -> np.ndarray:
    return 1.5 * np.sin(2 * np.pi * x / 3000)  # m, over m


@pytest.fixture(scope="module")
def logs(generator: Callable[[str], np.random.Generator]) -> list[gf.Log]:
    return [
        dataclasses.replace(log, y=log.y + deviation(log.truth["x"])[:, None])
        for log in tracks(generator("route"), 14, 100)
    ]


def truth_of(log: gf.Log) -> np.ndarray:
    return np.stack([log.truth["x"], log.truth["v"]], axis=1)


@pytest.fixture(scope="module")
def learned(logs: list[gf.Log]) -> tuple[SensorMap, SensorMapReport]:
    return gf.learn_sensor_map(
        MODEL, logs, [truth_of(log) for log in logs], "fix", ["x"], key=jax.random.key(0), training=FINE, held_out=4
    )


def test_the_map_is_the_error(learned: tuple[SensorMap, SensorMapReport]) -> None:
    each, report = learned
    x = np.linspace(500.0, 4000.0, 50)
    said = np.array([each.error(jnp.array([value])) for value in x])
    # A tile is 8 of 128 quanta of some 5 km wide, over which the error changes by up to 1 m; noise of 0.08 m averages out.
    assert np.sqrt(np.mean((said - deviation(x)) ** 2)) < 0.15
    assert report.after < 0.25 * report.before
    assert report.warnings == ()


def test_a_filter_of_the_mapped_model_is_as_good_as_without_the_error(
    learned: tuple[SensorMap, SensorMapReport], logs: list[gf.Log]
) -> None:
    mapped = gf.with_sensor_maps(MODEL, [learned[0]])
    squares = {}
    for name, model in (("plain", MODEL), ("mapped", mapped)):
        errors = [gf.run(FILTER, model, prior(), log).error()[20:90, 0] for log in logs[-4:]]
        squares[name] = np.mean(np.square(errors))
    assert squares["mapped"] < 0.05 * squares["plain"]


def test_beyond_what_was_seen_the_sensor_is_left_as_it_was(learned: tuple[SensorMap, SensorMapReport]) -> None:
    mapped = gf.with_sensor_maps(MODEL, [learned[0]])
    inside, outside = jnp.array([2000.0, 5.0]), jnp.array([-5000.0, 5.0])
    np.testing.assert_array_equal(mapped.observe(outside, WHEN), MODEL.observe(outside, WHEN))
    np.testing.assert_array_equal(mapped.measurement_noise(outside, WHEN), [[0.08**2]])
    assert abs(float((mapped.observe(inside, WHEN) - MODEL.observe(inside, WHEN))[0])) > 0.5
    np.testing.assert_allclose(mapped.measurement_noise(inside, WHEN), [[float(learned[0].std) ** 2]], rtol=1e-12)


def test_the_noise_left_has_a_floor(logs: list[gf.Log]) -> None:
    floored, _ = gf.learn_sensor_map(
        MODEL,
        logs,
        [truth_of(log) for log in logs],
        "fix",
        ["x"],
        key=jax.random.key(0),
        training=FINE,
        floor=0.5,
        every=2,
        start=50.0,
        end=50.0,
    )
    assert float(floored.std) == 0.5


def test_a_teacher_that_used_the_sensor_is_warned_of_and_a_second_pass_starts_from_the_bare_sensor(
    learned: tuple[SensorMap, SensorMapReport], logs: list[gf.Log]
) -> None:
    mapped = gf.with_sensor_maps(MODEL, [learned[0]])
    results = [gf.smooth(gf.run(FILTER, mapped, prior(), log)) for log in logs[:4]]
    again, report = gf.learn_sensor_map(
        mapped, logs[:4], results, "fix", ["x"], key=jax.random.key(0), training=PerceptronTraining(iterations=100)
    )
    assert any("the teacher used fix itself" in text for text in report.warnings)
    # The whole error again, not what the first map left of it.
    assert abs(float(again.error(jnp.array([750.0]))) - 1.5) < 0.5


def _turn(x: jax.Array, u: jax.Array, t: jax.Array, dt: jax.Array) -> jax.Array:
    return x + dt * u


def _heading(x: jax.Array) -> jax.Array:
    return x


def test_a_map_of_an_angle_closes(rng: np.random.Generator) -> None:
    model = gf.discrete_model(
        _turn, _heading, states={"psi": "angle"}, outputs={"compass": "angle"}, inputs={"rate": "rad/s"}, Q=1e-6, R=1e-4
    )
    t = np.arange(1500.0)
    psi = np.cumsum(np.full(1500, 0.05))
    wrapped = psi - 2 * np.pi * np.round(psi / (2 * np.pi))
    error = 0.07 * np.sin(psi) - 0.05 * np.cos(psi)  # rad
    log = gf.make_log(model, t, psi + error + 0.01 * rng.normal(size=1500), np.full(1500, 0.05))
    each, _ = gf.learn_sensor_map(
        model,
        [log],
        [wrapped[:, None]],
        "compass",
        ["compass"],
        key=jax.random.key(0),
        training=CMACTraining(levels=80, layers=16, compress="none", epochs=10),
    )
    below, above = (float(each.error(jnp.array([angle]))) for angle in (np.pi - 0.01, -np.pi + 0.01))
    # A quantum is 0.1 rad wide, over which the error turns by 0.007; noise adds about as much.
    assert abs(below - above) < 0.03
    assert abs(below - 0.05) < 0.03
    mapped = gf.with_sensor_maps(model, [each])
    when = Instant(jnp.array(0.0), jnp.array(1.0), jnp.zeros(1))
    turned = mapped.observe(jnp.array([1.5]), when)[0]
    assert abs(float(turned) - 1.5 - (0.07 * np.sin(1.5) - 0.05 * np.cos(1.5))) < 0.03
