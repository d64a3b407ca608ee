"""Records of the servo axis: row by row as written, the same however they are drawn, and told apart by their noise only."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.faults import Bias, parameter_tracks
from gainful.models import Instant, augment, runge_kutta_4
from gainful.plants import (
    HydraulicServo,
    HydraulicServoParameters,
    ReducedHydraulicServo,
    drive_servo,
    hydraulic_servo,
    hydraulic_servo_reduced,
    interval_times,
    prbs,
)
from gainful.running import GaussianMixture, ImpulseBursts, StudentTNoise

ROWS = 60
U = prbs(ROWS)
FAULTS = [Bias("p1", 1.0, onset=0.02), Bias("p2", -0.4, onset=0.03)]
KEYS = jax.random.split(jax.random.key(5), 3)
QUIET = {"measurement_sigmas": (0.0, 0.0, 0.0), "process_sigmas": (0.0, 0.0, 0.0)}


def tracks():
    return parameter_tracks(interval_times(ROWS), {"p1": 1.0, "p2": 1.0}, FAULTS)


@pytest.fixture(scope="module", params=["reduced", "full"])
def recorded(request):
    """A compiled experiment with outliers and faults on each plant."""

    def record(key):
        noise = GaussianMixture()
        return drive_servo(U, tracks(), key=key, plant=request.param, measurement_noise=noise)

    return record, jax.jit(record)


def test_a_row_holds_its_own_voltage_and_parameters_over_the_interval_that_ends_there():
    record = drive_servo(U, tracks(), key=KEYS[0], **QUIET)
    x, servo = jnp.zeros(3), ReducedHydraulicServo()
    for i in range(ROWS):
        p1, p2 = (2.0 if i >= 20 else 1.0), (0.6 if i >= 30 else 1.0)
        x = servo.step(x, U[i], jnp.asarray(p1), jnp.asarray(p2))
        np.testing.assert_allclose(record.states[i], x, atol=1e-12)
        np.testing.assert_allclose(record.parameters[i], [p1, p2], rtol=1e-12)
    assert record.y.tolist() == record.states.tolist()
    assert record.u[:, 0].tolist() == U.tolist()
    np.testing.assert_allclose(record.t[:: ROWS - 1], [0.001, 0.001 * ROWS], rtol=1e-12)


def test_the_full_plant_starts_at_rest_and_tells_the_parameters_its_reduced_model_should_find():
    record = drive_servo(U, tracks(), key=KEYS[0], plant="full")
    servo = HydraulicServo()
    own = servo.parameters
    stiffness = own.stiffness(record.plant[:, 0]) / own.stiffness(own.centre)
    np.testing.assert_allclose(record.parameters[:, 1], tracks()[:, 1] * stiffness, rtol=1e-12)
    np.testing.assert_allclose(record.parameters[:, 0], tracks()[:, 0], rtol=1e-12)
    np.testing.assert_allclose(record.states, jax.vmap(servo.scaled)(record.plant), atol=1e-12)
    assert np.abs(record.states[0]).max() < 0.5


def test_four_steps_of_runge_kutta_in_a_millisecond_are_enough_for_the_full_plant():
    still = HydraulicServoParameters(load_force=0.0)
    record = drive_servo(U, key=KEYS[0], plant="full", numbers=still)
    servo = HydraulicServo()

    def step(x, u):
        def finer(_, z):
            return runge_kutta_4(lambda z, t: servo.rate(z, u, jnp.ones(()), jnp.ones(())), z, jnp.zeros(()), 1e-4)

        x = jax.lax.fori_loop(0, 10, finer, x)
        return x, x

    fine = jax.lax.scan(step, servo.start, U)[1]
    difference = np.abs(np.asarray(record.plant - fine)).max(axis=0)
    assert difference[0] < 1e-9  # m
    assert difference[2:].max() < 4.0  # Pa


def test_many_records_at_once_are_the_same_as_one_after_the_other(recorded):
    record, compiled = recorded
    batch = jax.jit(jax.vmap(record))(KEYS)
    for i, key in enumerate(KEYS):
        alone = compiled(key)
        for name in ("y", "states", "parameters", "variance", "plant"):
            np.testing.assert_allclose(getattr(batch, name)[i], getattr(alone, name), rtol=1e-12, atol=1e-12)


def test_compiled_records_are_those_of_the_interpreter(recorded):
    record, compiled = recorded
    eager, fast = record(KEYS[0]), compiled(KEYS[0])
    for name in ("y", "states", "plant"):
        np.testing.assert_allclose(getattr(eager, name), getattr(fast, name), rtol=1e-11, atol=1e-11)


def test_sensors_that_are_left_out_change_no_other_reading():
    everything = drive_servo(U, key=KEYS[1], measurement_noise=ImpulseBursts(0.1))
    some = drive_servo(U, key=KEYS[1], measurement_noise=ImpulseBursts(0.1), sensors=("load_pressure", "position"))
    assert some.y.tolist() == everything.y[:, jnp.array([2, 0])].tolist()
    assert some.variance.tolist() == everything.variance[:, jnp.array([2, 0])].tolist()
    assert some.states.tolist() == everything.states.tolist()


def test_the_noise_of_the_readings_does_not_touch_the_plant_nor_the_other_way_round():
    plain = drive_servo(U, key=KEYS[2])
    heavy = drive_servo(U, key=KEYS[2], measurement_noise=StudentTNoise())
    shaken = drive_servo(U, key=KEYS[2], process_noise=GaussianMixture(0.05, 10.0))
    assert heavy.states.tolist() == plain.states.tolist()
    np.testing.assert_allclose(shaken.y - shaken.states, plain.y - plain.states, atol=1e-12)
    assert np.abs(shaken.states - plain.states).max() > 0.01


def test_a_model_that_is_told_the_variances_uses_each_samples_own():
    record = drive_servo(U, key=KEYS[0], measurement_noise=GaussianMixture(), sensors=("velocity", "position"))
    model = hydraulic_servo_reduced(sensors=("velocity", "position"), told_variances=True)
    samples = record.told_samples
    assert len(np.unique(np.asarray(record.variance)[:, 0].round(12))) == 2
    for i in range(0, ROWS, 7):
        moment = jax.tree.map(lambda leaf, i=i: leaf[i], samples.when)
        noise = model.measurement_noise(record.states[i], moment)
        np.testing.assert_allclose(noise, np.diag(record.variance[i]), rtol=1e-12)
        # It moves by the voltage, as the model without them does.
        own = Instant(moment.t, moment.dt, moment.u[:1])
        plain = hydraulic_servo_reduced().transition(record.states[i], own)
        assert model.transition(record.states[i], moment).tolist() == plain.tolist()


def test_a_record_becomes_a_log_of_the_joint_model():
    record = drive_servo(U, key=KEYS[0])
    model = augment(hydraulic_servo_reduced(), parameters={"p1": 0.1, "p2": 0.1})
    log = gf.make_log(model, record.t, record.y, record.u, truth=record.truth, start=0.0)
    np.testing.assert_allclose(log.dt, 1e-3, rtol=1e-9)
    assert log.truth["p2"].tolist() == record.parameters[:, 1].tolist()


def test_a_filter_with_the_full_model_is_consistent_on_the_full_plant_in_si_units():
    rows, own = 500, HydraulicServoParameters()
    record = drive_servo(prbs(rows), jnp.tile(jnp.array([1.3, 0.8]), (rows, 1)), key=KEYS[0], plant="full")
    model = augment(hydraulic_servo(), parameters={"p1": 0.0, "p2": 0.0})
    readings = np.asarray(record.y * own.scales + jnp.array([0.15, 0.0, 0.0]))
    log = gf.make_log(model, record.t, readings, record.u, start=0.0)
    prior = gf.make_prior(model, [0.15, 0.0, 3.2e6, 5.25e6, 1.0, 1.0], [1e-3, 0.01, 2e5, 2e5, 0.5, 0.5])
    result = gf.run(gf.extended_kalman_filter(), model, prior, log)
    # Of a chi-square with 3 degrees per row: mean 3, variance 6.
    assert np.mean(result.nis) == pytest.approx(3.0, abs=4.0 * np.sqrt(6.0 / rows))
    error = result.mean[-1] - np.concatenate([record.plant[-1], [1.3, 0.8]])
    std = np.sqrt(np.diagonal(result.cov[-1]))
    assert np.all(np.abs(error) < 4.0 * std)
    assert np.all(std[4:] < 0.05)
