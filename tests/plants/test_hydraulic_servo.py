"""The servo axis has the published numbers, its reduced model is the full one linearised, and its oil keeps its balances."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.models import Instant, augment, runge_kutta_4
from gainful.plants import (
    HydraulicServo,
    HydraulicServoParameters,
    ReducedHydraulicServo,
    drive_servo,
    hydraulic_servo,
    hydraulic_servo_reduced,
    prbs,
)

STEP = 1e-3  # s
ONE = jnp.ones(())


def when(voltage):
    return Instant(jnp.asarray(STEP), jnp.asarray(STEP), jnp.atleast_1d(jnp.asarray(voltage)))


@pytest.fixture(scope="module")
def joint():
    return augment(hydraulic_servo_reduced(), parameters={"p1": 0.1, "p2": 0.1})


@pytest.fixture(scope="module")
def frictionless():
    """A full axis in which only the oil and the spring act."""
    return HydraulicServo(
        HydraulicServoParameters(viscous_friction=0.0, coulomb_friction=0.0, static_friction=0.0, leakage=0.0)
    )


def states(generator, count):
    """States of the full axis over most of its range, with voltages."""
    rng = generator("states of the axis")
    low, high = np.array([0.02, -0.4, 0.5e6, 0.5e6]), np.array([0.28, 0.4, 9e6, 9e6])  # m, m/s, Pa, Pa
    return jnp.asarray(rng.uniform(low, high, (count, 4))), jnp.asarray(rng.uniform(-5.0, 5.0, count))


def test_the_reduced_model_moves_to_the_published_point(joint):
    moved = joint.transition(jnp.array([0.1, 0.2, -0.3, 1.1, 0.9]), when(0.8))
    np.testing.assert_allclose(moved, [0.10364286, 0.1642167, -0.33658228, 1.1, 0.9], atol=5e-9)


def test_the_coefficients_are_the_published_ones():
    published = {"a12": 20, "a21": 25, "a22": 50, "a23": 62.83185, "a_C": 3, "a32": 1305.52029, "a33": 31.511739}
    found = {name: float(value) for name, value in ReducedHydraulicServo().coefficients.items()}
    assert found == pytest.approx(published | {"b3": 233.752508}, rel=1e-7)


def test_the_oil_column_swings_at_the_published_frequency_with_the_published_damping():
    a = {name: float(value) for name, value in ReducedHydraulicServo().coefficients.items()}
    poles = np.linalg.eigvals([[0, a["a12"], 0], [-a["a21"], -a["a22"], a["a23"]], [0, -a["a32"], -a["a33"]]])
    frequency = np.sqrt(a["a23"] * a["a32"])
    assert frequency == pytest.approx(286.4, abs=0.05)  # rad/s
    assert (a["a22"] + a["a33"]) / (2 * frequency) == pytest.approx(0.142, abs=5e-4)
    assert min(poles, key=abs).real == pytest.approx(-0.187, abs=5e-4)  # 1/s
    # Why a forward Euler step will not do at 1 ms: it makes the damped column unstable.
    assert np.abs(1 + STEP * poles).max() == pytest.approx(1.0014, abs=5e-5)


def test_the_derivative_of_the_map_is_what_central_differences_say(joint, generator):
    rng = generator("jacobian")
    step = jax.jit(lambda z, then: joint.transition(z, then))
    slope = jax.jit(lambda z, then: jax.jacfwd(joint.transition)(z, then))
    for _ in range(5):
        z = jnp.asarray(rng.normal([0, 0, 0, 1.1, 0.9], [0.3, 0.5, 1.0, 0.2, 0.2]))
        then = when(rng.normal())
        # Third derivatives are below 1e3 (tanh at 0.05 over 1 ms): with h = 1e-5 the differences err by 2e-8 at most.
        differences = np.stack([(step(z + d, then) - step(z - d, then)) / 2e-5 for d in 1e-5 * np.eye(5)], axis=1)
        np.testing.assert_allclose(slope(z, then), differences, atol=1e-7)


def test_without_dry_friction_the_map_is_the_exponential_up_to_its_fourth_power(generator):
    servo = ReducedHydraulicServo(HydraulicServoParameters(coulomb_friction=0.0))
    a = {name: float(value) for name, value in servo.coefficients.items()}
    rng = generator("exponential")
    for _ in range(5):
        p1, p2 = rng.uniform(0.5, 2.0, 2)
        big = np.zeros((4, 4))
        big[0, 1], big[1, :3] = a["a12"], [-a["a21"], -p1 * a["a22"], a["a23"]]
        big[2, 1:] = p2 * np.array([-a["a32"], -a["a33"], a["b3"]])
        series = sum(np.linalg.matrix_power(STEP * big, k) / np.prod(np.arange(1.0, k + 1)) for k in range(5))
        x, u = rng.normal(size=3), rng.normal()
        found = servo.step(jnp.asarray(x), jnp.asarray(u), jnp.asarray(p1), jnp.asarray(p2))
        np.testing.assert_allclose(found, (series @ [*x, u])[:3], atol=1e-12)


def test_the_reduced_model_is_the_full_one_linearised_about_the_centre():
    full = HydraulicServo(HydraulicServoParameters(coulomb_friction=0.0, static_friction=0.0))
    own, a = full.parameters, ReducedHydraulicServo(full.parameters).coefficients
    y, v, p = own.scales
    slope = jax.jacfwd(full.rate)(full.start, 0.0 * ONE, 1.3 * ONE, 0.8 * ONE)
    load = slope[2] - own.area_ratio * slope[3]
    assert float(slope[0, 1] * v / y) == pytest.approx(float(a["a12"]), rel=1e-12)
    assert float(slope[1, 0] * y / v) == pytest.approx(-float(a["a21"]), rel=1e-12)
    assert float(slope[1, 1]) == pytest.approx(-1.3 * float(a["a22"]), rel=1e-12)
    # Only the load pressure accelerates: the same from A, and with the opposite sign of the ratio from B.
    assert float(slope[1, 2] * p / v) == pytest.approx(float(a["a23"]), rel=1e-12)
    assert float(slope[1, 3] / slope[1, 2]) == pytest.approx(-float(own.area_ratio), rel=1e-12)
    assert float(load[1] * v / p) == pytest.approx(-0.8 * float(a["a32"]), rel=1e-12)
    # Oil that leaks from chamber to chamber changes the load pressure by the stiffness a33 is made of.
    leak = own.leakage * own.bulk_modulus * own.leak_stiffness(own.centre)
    assert float(load[2]) == pytest.approx(-0.8 * float(leak), rel=1e-12)
    assert float(load[3]) == pytest.approx(0.8 * float(leak), rel=1e-12)


def test_the_asymmetric_model_has_the_mean_flow_of_the_nominal_run_in_each_direction():
    own = HydraulicServoParameters(load_force=0.0)
    voltage, full = prbs(1500), HydraulicServo(own)
    record = drive_servo(voltage, key=jax.random.key(0), plant="full", numbers=own)

    def gain(x, u):
        into_a, out_b = full.flows(u, x[2], x[3])
        shared = into_a / own.volume_a(x[0]) + own.area_ratio * out_b / own.volume_b(x[0])
        return shared / own.stiffness(own.centre) / u

    gains = np.asarray(jax.jit(jax.vmap(gain))(record.plant, voltage))
    servo = ReducedHydraulicServo(own, asymmetric=True)
    for sign in (1.0, -1.0):
        mean = gains[np.asarray(voltage) == sign].mean()
        rise = servo.rate(jnp.zeros(3), jnp.asarray(sign), ONE, ONE)[2] / sign * own.scales[2]
        found = float(rise / own.bulk_modulus / own.stiffness(own.centre))
        assert found == pytest.approx(mean, rel=0.01)
    assert gains.mean() == pytest.approx(float(own.flow_gain), rel=0.01)


def test_at_the_start_forces_balance_and_the_reduced_state_is_zero():
    servo = HydraulicServo()
    rates = servo.rate(servo.start, 0.0 * ONE, ONE, ONE)
    np.testing.assert_allclose(rates[:2], 0.0, atol=1e-12)  # m/s, m/s^2 with forces of 4 kN
    np.testing.assert_allclose(servo.scaled(servo.start), 0.0, atol=1e-12)
    # Pressures differ, so that oil leaks from B to A.
    assert rates[2] > 0 > rates[3]
    np.testing.assert_allclose(servo.reference_parameters(servo.start, ONE, 0.7 * ONE), [1.0, 0.7], rtol=1e-12)


def energies(servo, state, constants):
    """Mechanical energy, and with that of the oil in both closed chambers [J]; the constants are `p + b ln V`."""
    own = servo.parameters
    position, velocity = state[:2]
    mechanical = 0.5 * own.mass * velocity**2 + 0.5 * own.spring * (position - own.centre) ** 2
    oil = sum(
        own.bulk_modulus * (volume * jnp.log(volume) - volume) - constant * volume
        for volume, constant in zip((own.volume_a(position), own.volume_b(position)), constants, strict=True)
    )
    return mechanical, mechanical + oil


def chambers(servo, state):
    own = servo.parameters
    return (
        state[2] + own.bulk_modulus * jnp.log(own.volume_a(state[0])),
        state[3] + own.bulk_modulus * jnp.log(own.volume_b(state[0])),
    )


def test_closed_chambers_keep_their_oil_and_their_energy(frictionless):
    start = frictionless.start.at[1].set(0.2)  # m/s

    def move(x, _):
        x = runge_kutta_4(lambda z, t: frictionless.rate(z, 0.0 * ONE, ONE, ONE), x, 0.0 * ONE, jnp.asarray(1e-4))
        return x, x

    _, path = jax.jit(lambda: jax.lax.scan(move, start, None, length=1000))()
    oil = np.stack(jax.vmap(lambda x: jnp.stack(chambers(frictionless, x)))(path))
    constants = chambers(frictionless, start)
    swing = np.ptp(np.asarray(path[:, 2]))
    assert swing > 1e6  # Pa: the test is of something that happens
    # Runge-Kutta's phase error is (w h)^5 / 120 = 3e-10 per step of 0.1 ms at 310 rad/s, over 1000 steps.
    np.testing.assert_allclose(oil, np.broadcast_to(constants, oil.shape), atol=1e-6 * swing)
    total = np.asarray(jax.vmap(lambda x: energies(frictionless, x, constants)[1])(path))
    kinetic = 0.5 * 100.0 * 0.2**2  # J
    assert np.ptp(total) < 1e-4 * kinetic


def test_work_of_the_oil_is_what_the_load_gains_and_friction_takes(generator):
    servo = HydraulicServo()
    own = servo.parameters

    def gained(x, u):
        rate = servo.rate(x, u, 1.2 * ONE, ONE, 70.0)
        return jax.jvp(lambda z: energies(servo, z, (0.0, 0.0))[0], (x,), (rate,))[1]

    def worked(x, u):
        oil = own.area_a * own.load_pressure(x[2], x[3])
        return x[1] * (oil - servo.friction(x[1], 1.2 * ONE) - 70.0)

    given = states(generator, 50)
    # Of terms of up to 11 kN times 0.4 m/s.
    np.testing.assert_allclose(jax.vmap(gained)(*given), jax.vmap(worked)(*given), atol=1e-10 * 4400.0)


def test_with_a_closed_valve_energy_is_only_lost(generator):
    servo = HydraulicServo()

    def power(x, _):
        rate = servo.rate(x, 0.0 * ONE, ONE, ONE)
        own = servo.parameters
        stored = x[2] / own.bulk_modulus * own.volume_a(x[0]), x[3] / own.bulk_modulus * own.volume_b(x[0])
        mechanical = jax.jvp(lambda z: energies(servo, z, (0.0, 0.0))[0], (x,), (rate,))[1]
        return mechanical + stored[0] * rate[2] + stored[1] * rate[3]

    found = jax.vmap(power)(*states(generator, 50))
    assert np.all(np.asarray(found) < 0)


def test_oil_flows_down_the_pressure_through_the_edges_a_voltage_opens():
    servo = HydraulicServo()
    in_a, out_b = servo.flows(ONE, jnp.asarray(5e6), jnp.asarray(5e6))
    assert in_a > 0
    assert out_b > 0
    in_a, out_b = servo.flows(-ONE, jnp.asarray(5e6), jnp.asarray(5e6))
    assert in_a < 0
    assert out_b < 0
    assert servo.flows(ONE, jnp.asarray(11e6), jnp.asarray(5e6))[0] < 0  # more pressure than the supply: backwards
    assert [float(flow) for flow in servo.flows(0.0 * ONE, jnp.asarray(5e6), jnp.asarray(5e6))] == [0.0, 0.0]


def test_the_full_model_of_the_library_moves_as_the_plant_does_and_its_force_shakes_the_speed():
    model, servo = hydraulic_servo(), HydraulicServo()
    x = servo.start
    for _ in range(4):
        x = runge_kutta_4(lambda z, t: servo.rate(z, ONE, ONE, ONE), x, 0.0 * ONE, jnp.asarray(STEP / 4))
    np.testing.assert_allclose(model.transition(servo.start, when(1.0)), x, rtol=1e-12)
    # 100 N held for 1 ms on 100 kg is 1 mm/s. Friction of 50 1/s takes 1 - d = 5 % off its square within the step, and the
    # oil (w h)^2 / 3 = 3 %.
    moving = servo.start.at[1].set(0.2)
    assert float(model.process_noise(moving, when(1.0))[1, 1]) == pytest.approx(0.92e-6, rel=0.02)  # m^2/s^2
    np.testing.assert_allclose(model.observe(servo.start, when(1.0)), [0.15, 0.0, 0.0], atol=1e-6)


@pytest.mark.parametrize("sensors", [("position",), ("load_pressure", "position")])
def test_the_reduced_model_has_the_sensors_asked_for_in_their_order(sensors):
    model = hydraulic_servo_reduced(sensors=sensors, measurement_sigmas=(0.1, 0.2, 0.3))
    x = jnp.array([1.0, 2.0, 3.0])
    expected = {"position": (1.0, 0.01), "load_pressure": (3.0, 0.09)}
    np.testing.assert_allclose(model.observe(x, when(0.0)), [expected[name][0] for name in sensors])
    noise = np.diag(model.measurement_noise(x, when(0.0)))
    np.testing.assert_allclose(noise, [expected[name][1] for name in sensors], rtol=1e-12)
    assert [name for name, _ in model.sensors] == list(sensors)


def test_noise_of_a_step_is_that_given_and_grows_with_the_step():
    model = hydraulic_servo_reduced(process_sigmas=(0.1, 0.2, 0.3))
    for factor in (1.0, 2.5):
        then = Instant(jnp.asarray(1.0), jnp.asarray(factor * STEP), jnp.zeros(1))
        noise = model.process_noise(jnp.zeros(3), then)
        np.testing.assert_allclose(noise, factor * np.diag([0.01, 0.04, 0.09]), rtol=1e-12)


def test_an_extended_kalman_filter_finds_the_parameters_of_a_record():
    model = augment(hydraulic_servo_reduced(), parameters={"p1": 0.0, "p2": 0.0})
    truth = gf.make_prior(model, {"position": 0, "velocity": 0, "load_pressure": 0, "p1": 1.4, "p2": 0.8}, np.zeros(5))
    t = STEP * np.arange(1, 401)
    log = gf.draw_log(model, truth, t, np.asarray(prbs(400))[:, None], key=jax.random.key(0))
    prior = gf.make_prior(model, [0, 0, 0, 1.0, 1.0], [0.1, 0.1, 0.3, 0.5, 0.5])
    result = gf.run(gf.extended_kalman_filter(), model, prior, log)
    error = np.asarray(result.mean[-1, 3:]) - [1.4, 0.8]
    std = np.sqrt(np.diagonal(result.cov[-1])[3:])
    assert np.all(std < 0.1)  # from 0.5: the input shows both
    assert np.all(np.abs(error) < 4.0 * std)


def test_numbers_that_differ_are_given_by_name_and_the_others_stay():
    heavy = hydraulic_servo({"mass": 200.0})
    own, default = heavy.dynamics.f.fn.servo.parameters, HydraulicServoParameters()
    assert float(own.mass) == 200.0
    assert float(own.bore) == float(default.bore)
    light = ReducedHydraulicServo(HydraulicServoParameters(mass=50.0)).coefficients
    assert float(light["a21"]) == pytest.approx(2.0 * 25.0, rel=1e-12)
