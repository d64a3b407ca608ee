"""The land vehicle's model is its own motion differentiated, turns with the scene, and drives are physics."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.estimates import Gaussian
from gainful.models import Instant
from gainful.plants import (
    compass_deviation,
    drive_vehicle,
    land_vehicle,
    lateral_speed,
    odometer_error,
)
from gainful.plants.land_vehicle import INTERVAL, START_SIGMAS
from gainful.running.run import scan


@pytest.fixture(scope="module")
def model():
    return land_vehicle()


@pytest.fixture(scope="module")
def record():
    return drive_vehicle(key=jax.random.key(1), duration=120.0)


def states(generator, count):
    size = np.array([500.0, 500.0, 15.0, 15.0, 2.0, 0.1, 0.1, 0.01, 0.05])
    rng = generator("vehicle states")
    return jnp.asarray(rng.uniform(-size, size, (count, 9))), jnp.asarray(rng.normal(size=(count, 3)) * [2.0, 2.0, 0.3])


def test_the_derivatives_are_what_central_differences_say(model, generator):
    def when(u):
        return Instant(jnp.asarray(1.0), jnp.asarray(INTERVAL), u)

    for function in (model.transition, model.observe):
        exact, value = (jax.jit(lambda x, u, fn=fn: fn(x, when(u))) for fn in (jax.jacfwd(function), function))
        for x, u in zip(*states(generator, 5), strict=True):
            steps = 1e-4 * np.eye(9)
            differences = np.stack([(value(x + d, u) - value(x - d, u)) / 2e-4 for d in steps], axis=1)
            # Third derivatives are speeds of up to 22 m/s: h^2 / 6 of them is 4e-8.
            np.testing.assert_allclose(exact(x, u), differences, atol=1e-7)


def test_residuals_of_the_heading_take_the_short_way_round(model):
    names = model.output.tangent_names
    x = jnp.zeros(9).at[4].set(math.radians(-179.0))
    expected = model.observe(x, Instant(jnp.zeros(()), jnp.zeros(()), jnp.zeros(3)))
    measured = expected.at[names.index("compass")].set(math.radians(178.0))
    assert float(model.output.minus(measured, expected)[names.index("compass")]) == pytest.approx(math.radians(-3.0))


def quarter_turned(record):
    """The same scene turned clockwise by a right angle: north becomes east, east becomes south."""

    def turned(values, east, north):
        return values.at[..., east].set(values[..., north]).at[..., north].set(-values[..., east])

    def heading(values, column):
        return values.at[..., column].add(math.pi / 2)

    y = heading(turned(turned(record.y, 3, 5), 4, 6), 2)
    parts = [heading(turned(turned(each, 0, 1), 2, 3), 4) for each in (record.states, record.start)]
    return eqx.tree_at(lambda each: (each.y, each.states, each.start), record, (y, *parts))


def test_turning_the_whole_scene_turns_the_result(model, record):
    @jax.jit
    def filtered(given):
        prior = Gaussian.start(given.start, jnp.diag(jnp.asarray(START_SIGMAS) ** 2), model.space)
        return scan(gf.extended_kalman_filter(), model, prior, given.samples)[1].estimate

    plain, turned = filtered(record), filtered(quarter_turned(record))
    assert np.isfinite(plain.mean).all()
    # The filter's rounding over 1200 steps, of positions of some hundred metres.
    np.testing.assert_allclose(turned.mean[:, 0], plain.mean[:, 1], atol=1e-6)
    np.testing.assert_allclose(turned.mean[:, 1], -plain.mean[:, 0], atol=1e-6)
    off = np.asarray(turned.mean[:, 4] - plain.mean[:, 4] - math.pi / 2)
    np.testing.assert_allclose(np.sin(off), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.cos(off), 1.0, atol=1e-9)
    np.testing.assert_allclose(turned.mean[:, 5:], plain.mean[:, 5:], atol=1e-9)


def test_without_errors_the_measured_motion_leads_to_the_true_one(model, record):
    """Truth is made of the same sums as the model, so that nothing but the sensors' errors is left to estimate."""
    x = np.asarray(record.states)
    heading, velocity = x[:, 4], x[:, 2:4]
    change = np.diff(velocity, axis=0) / INTERVAL
    s, c = np.sin(heading[:-1]), np.cos(heading[:-1])
    turn = np.diff(np.unwrap(heading)) / INTERVAL
    exact = np.stack([change[:, 0] * s + change[:, 1] * c, change[:, 0] * c - change[:, 1] * s, turn], axis=1)
    moved = jax.vmap(lambda x, u: model.transition(x, Instant(jnp.ones(()), jnp.asarray(INTERVAL), u)))(
        jnp.asarray(x[:-1]).at[:, 5:8].set(0.0), jnp.asarray(exact)
    )
    away = np.array(moved)[:, :5] - x[1:, :5]
    away[:, 4] = np.sin(away[:, 4])
    np.testing.assert_allclose(away, 0.0, atol=1e-9)


def test_sensors_err_by_their_repeatable_errors_and_little_noise(record):
    x, y = np.asarray(record.states), np.asarray(record.y)
    s, c = np.sin(x[:, 4]), np.cos(x[:, 4])
    forward, right = x[:, 2] * s + x[:, 3] * c, x[:, 2] * c - x[:, 3] * s
    turn = np.diff(np.unwrap(x[:, 4]), prepend=x[0, 4]) / INTERVAL
    np.testing.assert_allclose(right[1:], np.asarray(lateral_speed(forward, turn))[1:], atol=1e-9)
    # Commanded accelerations are those of the next 0.1 s but where the vehicle comes to rest.
    acceleration = np.diff(forward, prepend=forward[0]) / INTERVAL
    rolling = forward > 0.5
    left = y[:, 0] - forward - np.asarray(odometer_error(forward, acceleration))
    assert np.std(left[rolling]) == pytest.approx(0.05, rel=0.2)
    slow = np.asarray(record.seen)[:, 2]
    off = y[slow, 2] - x[slow, 4] - np.asarray(compass_deviation(x[slow, 4]))
    # 121 readings: four standard errors of their spread are a quarter of it.
    assert np.std(np.arctan2(np.sin(off), np.cos(off))) == pytest.approx(math.radians(1.5), rel=0.26)


def test_an_outage_takes_the_satellites_away_and_nothing_else(record):
    out = record.with_outage(50.0, 80.0)
    t, before, after = np.asarray(record.t), np.asarray(record.seen), np.asarray(out.seen)
    inside = (t > 50.0) & (t <= 80.0)
    assert not after[inside][:, 3:].any()
    np.testing.assert_array_equal(after[~inside], before[~inside])
    np.testing.assert_array_equal(after[:, :3], before[:, :3])
    assert before[:, 3].sum() == 121
    assert before[:, 0].all()


def test_a_drive_stays_within_what_tyres_and_engine_can_do(record):
    x = np.asarray(record.states)
    speed = np.hypot(x[:, 2], x[:, 3])
    turn = np.diff(np.unwrap(x[:, 4])) / INTERVAL
    assert speed.max() < 21.0
    assert np.abs(turn * np.maximum(speed[1:], 3.0)).max() < 3.1
