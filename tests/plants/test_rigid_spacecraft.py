"""The spacecraft keeps what physics keeps, and its model predicts it."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.models import Instant
from gainful.plants import (
    InertialQuaternion,
    OrbitAngles,
    RigidSpacecraft,
    SwingTarget,
    TargetAngles,
    Wheels,
    pyramid_axes,
    rigid_spacecraft,
    spacecraft_model,
)
from gainful.plants.rigid_spacecraft import DEGREE
from gainful.running import AbstractController, Rates, Reading, Simulated, simulate
from gainful.spaces import rotate
from gainful.testing import check_model

INERTIA = [[17.0, 0.4, -0.3], [0.4, 12.0, 0.2], [-0.3, 0.2, 10.0]]  # kg m^2
TARGET = SwingTarget()
FORMS = {"target": TargetAngles(TARGET), "orbit": OrbitAngles(TARGET), "quaternion": InertialQuaternion(TARGET)}
QUIET: dict[str, Any] = {"torque_density": 0.0, "gyro_sigma": 0.0, "star_tracker_sigma": 0.0, "disturbance": 0.0}


class OpenLoop(AbstractController):
    """Commands that swing, whatever is read."""

    amplitude: jax.Array
    offset: jax.Array

    def init(self) -> None:
        return None

    def act(self, carry: None, t: jax.Array, reading: Reading) -> tuple[None, jax.Array]:
        return None, self.offset + self.amplitude * jnp.sin(0.3 * t)


@eqx.filter_jit
def flown(craft: RigidSpacecraft, controller: AbstractController, duration: float, key: jax.Array) -> Simulated:
    return simulate(craft, controller, key=key, duration=duration)


def angular_momentum(craft: RigidSpacecraft, flight: Simulated) -> np.ndarray:
    """Of body and wheels together, in inertial axes [N m s] (T, 3)."""

    def one(state: Any) -> jax.Array:
        own = craft.inertia @ state.rate + craft.wheels.axes @ state.momentum
        return rotate(state.attitude, own)

    return np.asarray(jax.vmap(one)(flight.state))


def test_body_and_wheels_together_keep_their_angular_momentum(key: jax.Array) -> None:
    craft = RigidSpacecraft(INERTIA, Wheels(pyramid_axes()), disturbance=0.0)
    controller = OpenLoop(jnp.array([0.08, -0.05, 0.03, 0.06]), jnp.zeros(4))
    flight = flown(craft, controller, 60.0, key)
    momentum = angular_momentum(craft, flight)
    exchanged = np.ptp(np.asarray(flight.state.momentum), axis=0).max()
    assert exchanged > 0.3  # the wheels did work; noise is on as well
    # Runge-Kutta leaves about (w dt)^5 / 120 = (0.1 * 0.01)^5 / 120 of it in each of 6000 steps, less than rounding,
    # which for a walk of 6000 steps with some ten roundings each is sqrt(6e4) eps of what is exchanged.
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), rtol=0, atol=3e-13)


def test_the_disturbance_is_all_that_changes_the_angular_momentum(key: jax.Array) -> None:
    craft = RigidSpacecraft(disturbance=1e-3)
    flight = flown(craft, OpenLoop(jnp.zeros(3), jnp.zeros(3)), 10.0, key)
    change = np.diff(angular_momentum(craft, flight), axis=0)
    middle = jnp.asarray(0.5 * (flight.t[1:] + flight.t[:-1]))
    halfway = jax.tree.map(lambda values: 0.5 * (values[1:] + values[:-1]), flight.state.attitude)
    expected = 0.05 * jax.vmap(rotate)(halfway, jax.vmap(craft.disturbance_torque)(middle))
    # The trapezoid's error: 0.05 s at rates of 0.05 rad/s, squared, of 5e-5 N m s.
    np.testing.assert_allclose(change, expected, rtol=0, atol=5e-5 * (0.05 * 0.1) ** 2)


def test_a_full_wheel_gives_no_torque_and_says_so(key: jax.Array) -> None:
    craft = RigidSpacecraft(disturbance=0.0)
    flight = flown(craft, OpenLoop(jnp.zeros(3), jnp.array([-0.1, 0.05, 0.0])), 30.0, key)
    momentum, applied = np.asarray(flight.state.momentum), np.asarray(flight.applied)
    full = np.asarray(flight.t) > 21.0  # 2 N m s at 0.1 N m
    np.testing.assert_allclose(momentum[full, 0], 2.0, atol=0.02)  # the noise draws it down and it comes back
    assert momentum.max() <= 2.0 + 1e-12
    assert np.abs(applied[full, 0]).max() < 0.02  # N m; the command is -0.1
    np.testing.assert_allclose(applied[1:, 1], 0.05, rtol=1e-12)
    np.testing.assert_allclose(flight.command[:, 0], -0.1)
    np.testing.assert_allclose(flight.u, np.hstack([applied, np.vstack([momentum[:1], momentum[:-1]])]), atol=1e-15)


@pytest.mark.parametrize("name", FORMS)
def test_the_model_predicts_the_truth_where_there_is_no_noise(name: str, key: jax.Array) -> None:
    craft = RigidSpacecraft(INERTIA, Wheels(pyramid_axes()), FORMS[name], **QUIET)
    model = spacecraft_model(craft)
    flight = flown(craft, OpenLoop(jnp.array([0.08, -0.05, 0.03, 0.06]), jnp.zeros(4)), 40.0, key)
    dt = jnp.diff(flight.t)

    @jax.jit
    @jax.vmap
    def off(x: jax.Array, t: jax.Array, dt: jax.Array, u: jax.Array, after: jax.Array) -> jax.Array:
        return model.space.minus(model.transition(x, Instant(t, dt, u)), after)

    # A command changes every 0.1 s, so that each interval has one: what is left is Runge-Kutta's own.
    missed = np.asarray(off(flight.truth[:-1], flight.t[1:], dt, flight.u[1:], flight.truth[1:]))
    assert np.abs(missed).max() < 1e-11  # rad/s, rad
    np.testing.assert_allclose(flight.y, flight.truth, atol=1e-15)


def test_every_form_of_the_model_moves_alike(rng: np.random.Generator) -> None:
    t, dt = jnp.asarray(20.05), jnp.asarray(0.05)
    rate, q = jnp.array([0.5, -0.6, 0.62]), jnp.asarray([0.1, -0.2, 0.3, 0.4]) / np.sqrt(0.3)  # 1 rad/s
    u = jnp.asarray(rng.normal(size=6) * 0.1)
    rates, attitudes = [], []
    for name in ("target", "orbit", "quaternion"):
        craft = RigidSpacecraft(INERTIA, form=FORMS[name])
        start = jnp.concatenate([rate, craft.form.written(q, t - dt)])
        moved = spacecraft_model(craft).transition(start, Instant(t, dt, u))
        rates.append(moved[:3])
        attitudes.append(craft.form.tracking_error(moved[3:], t)[1])
    for k in (1, 2):
        np.testing.assert_allclose(rates[k], rates[0], atol=1e-14)
        np.testing.assert_allclose(attitudes[k], attitudes[0], atol=1e-6)


def test_an_euler_step_of_the_model_errs_by_the_square_of_the_interval(rng: np.random.Generator) -> None:
    craft = RigidSpacecraft(INERTIA)
    start = jnp.array([0.1, -0.06, 0.062, 0.2, -0.1, 0.3])  # rad/s, rad
    u = jnp.asarray(rng.normal(size=6) * 0.1)
    models = [spacecraft_model(craft, step=step) for step in ("runge_kutta_4", "euler")]  # type: ignore[arg-type]
    errors = []
    for dt in (0.05, 0.025):
        when = Instant(jnp.asarray(20.0 + dt), jnp.asarray(dt), u)
        exact, lagging = (model.transition(start, when) for model in models)
        errors.append(np.abs(lagging - exact).max())
    # The angles' acceleration is about 0.01 rad/s^2.
    assert 1e-7 < errors[0] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("name", FORMS)
def test_every_form_is_a_model(name: str) -> None:
    check_model(rigid_spacecraft(name), u=np.full(6, 0.05))  # type: ignore[arg-type]


def test_noise_is_that_of_the_published_step_and_grows_with_the_interval() -> None:
    model = rigid_spacecraft()
    x, u = jnp.zeros(6), jnp.zeros(6)
    for dt in (0.05, 0.2):
        when = Instant(jnp.zeros(()), jnp.asarray(dt), u)
        expected = np.concatenate([(5e-4 * 0.05 / np.array([17.0, 12.0, 10.0])) ** 2, np.full(3, 1e-14)])
        np.testing.assert_allclose(model.process_noise(x, when), np.diag(expected * dt / 0.05), rtol=1e-12, atol=0)
        sigmas = np.sqrt(np.diag(model.measurement_noise(x, when))) / DEGREE
        np.testing.assert_allclose(sigmas, [0.005] * 3 + [0.01] * 3)


def test_readings_and_torques_are_as_noisy_as_they_say(key: jax.Array) -> None:
    craft = RigidSpacecraft(disturbance=0.0)
    model = spacecraft_model(craft)
    flight = flown(craft, OpenLoop(jnp.zeros(3), jnp.zeros(3)), 100.0, key)
    count = len(flight.t)
    band = 4.0 / np.sqrt(2.0 * count)  # four sigma of a sample deviation
    noise = jax.vmap(model.output.minus)(flight.y, flight.truth)
    np.testing.assert_allclose(np.std(noise, axis=0) / DEGREE, [0.005] * 3 + [0.01] * 3, rtol=band)

    @jax.vmap
    def kick(x: jax.Array, t: jax.Array, u: jax.Array, after: jax.Array) -> jax.Array:
        return model.space.minus(after, model.transition(x, Instant(t, jnp.asarray(0.05), u)))[:3]

    kicks = np.asarray(kick(flight.truth[:-1], flight.t[1:], flight.u[1:], flight.truth[1:]))
    np.testing.assert_allclose(np.std(kicks, axis=0), 5e-4 * 0.05 / np.array([17.0, 12.0, 10.0]), rtol=band)


def test_a_wheel_that_adds_to_its_command_is_a_negative_bias_of_the_input(key: jax.Array) -> None:
    craft = RigidSpacecraft(**QUIET)
    model = gf.augment(spacecraft_model(craft), biases={"torque_x": 0.0})
    extra = 0.03  # N m
    flight = simulate(
        craft,
        OpenLoop(jnp.array([0.02, 0.03, 0.01]), jnp.zeros(3)),
        key=key,
        duration=0.5,
        rates=Rates(),
        actuator_fault=lambda u, t: u.at[0].add(extra),
    )
    last = Instant(flight.t[-1], jnp.asarray(0.05), flight.u[-1])
    for bias, close in ((-extra, True), (extra, False)):
        moved = model.transition(jnp.append(flight.truth[-2], bias), last)
        assert bool(jnp.max(jnp.abs(moved[:6] - flight.truth[-1])) < 1e-11) == close
