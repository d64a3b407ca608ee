"""The experiment flies as published: commands, momentum and rates in their bands, faults and what making up for them brings."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.control import Adjustment, EstimatedFaults, Reading, Unchanged
from gainful.plants import (
    InertialQuaternion,
    OrbitAngles,
    RigidSpacecraft,
    SlewTarget,
    SwingTarget,
    TargetAngles,
    Wheels,
    fly,
    pyramid_axes,
    spacecraft_model,
    tracking_controller,
)
from gainful.plants.rigid_spacecraft import DEGREE
from gainful.running import Observer, Simulated

ONSET, END = 50.0, 150.0  # s


class Offset(eqx.Module):
    """Added to the first signal between onset and end."""

    size: Any

    def __call__(self, value: jax.Array, t: jax.Array) -> jax.Array:
        return value.at[0].add(jnp.where((t >= ONSET) & (t < END), self.size, 0.0))


class Loss(eqx.Module):
    """A share of the first signal and an amount of it, between onset and end."""

    share: Any
    offset: Any

    def __call__(self, value: jax.Array, t: jax.Array) -> jax.Array:
        changed = value.at[0].set((1.0 - self.share) * value[0] + self.offset)
        return jnp.where((t >= ONSET) & (t < END), changed, value)


def pointing(flight: Simulated, first: float, last: float) -> float:
    """Root mean square of the angles relative to the target [deg]."""
    t, angles = np.asarray(flight.t), np.asarray(flight.truth[:, 3:])
    rows = (t >= first) & (t <= last)
    return float(np.sqrt(np.mean(np.sum((angles[rows] / DEGREE) ** 2, axis=1))))


@pytest.fixture(scope="module")
def flights() -> dict[str, Simulated]:
    """One flight without a fault and one with each published fault, all with the same noise."""

    @jax.jit
    @jax.vmap
    def one(share: jax.Array, offset: jax.Array, bias: jax.Array) -> Simulated:
        return fly(key=jax.random.key(3), actuator_fault=Loss(share, offset), sensor_fault=Offset(bias))

    together = one(jnp.array([0, 0, 0.5, 0]), jnp.array([0, 0.03, 0, 0]), jnp.array([0, 0, 0, 0.1]) * DEGREE)
    names = ("none", "offset", "loss", "gyro")
    return {name: jax.tree.map(lambda values, k=k: values[k], together) for k, name in enumerate(names)}


def test_rows_come_at_the_step_of_the_filter(flights: dict[str, Simulated]) -> None:
    flight = flights["none"]
    np.testing.assert_allclose(flight.t, np.arange(4001) * 0.05, rtol=1e-15)
    assert flight.truth.shape == flight.y.shape == flight.u.shape == (4001, 6)
    assert flight.command.shape == flight.state.momentum.shape == (4001, 3)


def test_commands_momentum_and_rates_are_as_large_as_published(flights: dict[str, Simulated]) -> None:
    sound = flights["none"]
    settled = np.asarray(sound.t) > 10.0  # s; the start is away from the target by two degrees
    assert np.abs(np.asarray(sound.applied)[settled]).max() == pytest.approx(0.06, abs=0.005)  # N m
    assert np.abs(sound.applied).max() < 0.075
    assert np.abs(sound.state.momentum).max() == pytest.approx(1.6, abs=0.1)  # N m s
    assert np.abs(np.asarray(sound.truth)[:, :3]).max() / DEGREE == pytest.approx(3.0, abs=0.2)  # deg/s
    worst = max(np.abs(np.asarray(flight.applied)).max() for flight in flights.values())
    assert worst == pytest.approx(0.1, abs=1e-12)


def test_the_command_about_x_passes_through_zero_where_the_faults_begin_and_end(flights: dict[str, Simulated]) -> None:
    command = np.asarray(flights["none"].applied)
    for time in (ONSET, END):
        assert abs(command[round(time / 0.05), 0]) < 0.005  # N m
    np.testing.assert_allclose(command[801], [-0.036, 0.019, 0.037], atol=0.004)  # published for 40 s; noise 0.002


def test_faults_pull_the_spacecraft_off_by_what_is_published(flights: dict[str, Simulated]) -> None:
    for name, published in (("offset", 1.121), ("loss", 1.709), ("gyro", 0.602)):  # deg
        assert pointing(flights[name], 60.0, ONSET + 100.0) == pytest.approx(published, rel=0.02), name
    assert pointing(flights["none"], 60.0, 150.0) < 0.02
    before = np.asarray(flights["none"].t) <= ONSET
    for flight in flights.values():
        np.testing.assert_array_equal(np.asarray(flight.truth)[before], np.asarray(flights["none"].truth)[before])


def test_the_initial_error_dies_out_as_the_gains_say() -> None:
    craft = RigidSpacecraft(torque_density=0.0, gyro_sigma=0.0, star_tracker_sigma=0.0, disturbance=0.0)
    flight = jax.jit(lambda: fly(craft, key=jax.random.key(0), duration=20.0))()
    t = np.asarray(flight.t)
    # Damping 0.9 at 0.3 rad/s, from rest; the angles are small enough to be one vector.
    damped = 0.3 * np.sqrt(1.0 - 0.9**2)
    decay = np.exp(-0.27 * t) * (np.cos(damped * t) + 0.27 / damped * np.sin(damped * t))
    expected = decay[:, None] * np.array([2.0, -1.0, 1.0])
    # A command held for 0.1 s comes 0.05 s late on average, which costs 0.05 s times 0.3 rad/s of the 2 degrees.
    np.testing.assert_allclose(flight.truth[:, 3:] / DEGREE, expected, atol=0.05 * 0.3 * 2.0)
    assert np.abs(flight.truth[-1, 3:]).max() / DEGREE < 0.02


def test_every_form_of_the_reading_flies_the_same() -> None:
    flights = []
    for form in (TargetAngles, OrbitAngles, InertialQuaternion):
        craft = RigidSpacecraft(form=form(SwingTarget()), gyro_sigma=0.0, star_tracker_sigma=0.0)
        flights.append(eqx.filter_jit(fly)(craft, key=jax.random.key(5), duration=5.0))
    for flight in flights[1:]:
        np.testing.assert_allclose(flight.command, flights[0].command, rtol=0, atol=1e-12)
        np.testing.assert_allclose(flight.state.attitude, flights[0].state.attitude, rtol=0, atol=1e-12)


def test_a_roll_through_ninety_degrees_is_no_place_to_lose_a_quaternion() -> None:
    craft = RigidSpacecraft(
        form=InertialQuaternion(SlewTarget((2.0 * DEGREE, 0.0, 0.0))), start_error=(0.0, 0.0, 0.0), disturbance=0.0
    )
    flight = jax.jit(lambda: fly(craft, key=jax.random.key(1), duration=60.0))()
    angles = jax.vmap(lambda x, t: craft.form.tracking_error(x, t)[0])(flight.truth[:, 3:], flight.t)
    assert np.abs(angles).max() / DEGREE < 0.1


def test_three_wheels_of_a_pyramid_fly_on_when_the_fourth_is_dead_and_out_of_use() -> None:
    craft = RigidSpacecraft(wheels=Wheels(pyramid_axes()))
    dead = 1.0 - jnp.eye(4)[1]

    @jax.jit
    @jax.vmap
    def one(active: jax.Array) -> Simulated:
        known = Unchanged(eqx.tree_at(lambda a: a.active, Adjustment.none(4), active))
        controller = tracking_controller(craft, reconfigure=known)
        return fly(craft, controller, key=jax.random.key(2), duration=60.0, actuator_fault=lambda u, t: u * dead)

    flights = one(jnp.stack([jnp.ones(4), dead]))
    unaware, aware = (jax.tree.map(lambda values, k=k: values[k], flights) for k in (0, 1))
    assert not np.any(aware.command[:, 1])
    assert np.any(unaware.command[:, 1])
    # The start takes 20 s to die out; then noise alone is left.
    assert pointing(aware, 30.0, 60.0) < 0.03
    assert pointing(unaware, 30.0, 60.0) > 10.0 * pointing(aware, 30.0, 60.0)


def test_making_up_for_the_estimated_fault_brings_the_spacecraft_back() -> None:
    craft = RigidSpacecraft()
    # 40 times the published walk of 2e-5 N m in 0.05 s: tuned for a fault that jumps.
    walks = {f"torque_{axis}": 8e-4 / np.sqrt(0.05) for axis in "xyz"}
    model = gf.augment(spacecraft_model(craft), biases=walks)
    start = np.concatenate([craft.truth(craft.init(), jnp.zeros(())), np.zeros(3)])
    prior = gf.make_prior(model, start, [0.005 * DEGREE] * 3 + [0.01 * DEGREE] * 3 + [1e-3] * 3)
    biases = {f"bias_torque_{axis}": (k, -1.0) for k, axis in enumerate("xyz")}
    controller = tracking_controller(
        craft,
        feedback="estimate",
        reconfigure=EstimatedFaults.named(model.space.names, 3, offset=biases),
    )
    through = Observer(gf.extended_kalman_filter(), model, prior)
    flight = jax.jit(
        lambda key: fly(craft, controller, key=key, duration=90.0, actuator_fault=Offset(0.03), observer=through)
    )(jax.random.key(4))
    assert flight.info is not None
    found = -np.asarray(flight.info.estimate.mean)[:, 6]
    late = np.asarray(flight.t) > 60.0
    assert np.mean(found[late]) == pytest.approx(0.03, rel=0.02)  # N m
    assert pointing(flight, 60.0, 90.0) < 0.025  # published 0.017 deg; 1.1 deg without


def test_the_law_leaves_a_linear_error_whatever_the_state() -> None:
    craft = RigidSpacecraft([[17.0, 1.0, 0.0], [1.0, 12.0, 2.0], [0.0, 2.0, 10.0]])
    law = tracking_controller(craft)
    t, rate, momentum = jnp.asarray(12.0), jnp.array([0.05, -0.03, 0.02]), jnp.array([0.5, -0.7, 0.2])
    attitude = jnp.array([0.02, -0.01, 0.03])
    torque = law.torque(t, rate, attitude, momentum)
    moment = torque - jnp.cross(rate, craft.inertia @ rate + momentum)
    acceleration = np.linalg.solve(np.asarray(craft.inertia), np.asarray(moment))
    # d w_e/dt with w_e = w - A w_t and dA/dt = -[w_e x] A, by differences of A w_t along the motion.
    target = craft.form.target
    to_body = craft.form.tracking_error(attitude, t)[1]
    error = rate - to_body @ target.rate(t)
    step = 1e-5  # s

    def carried(s: float) -> np.ndarray:
        turned = to_body - s * jnp.cross(error, to_body.T).T
        return np.asarray(turned @ target.rate(t + s))

    changed = acceleration - (carried(step) - carried(-step)) / (2.0 * step)
    np.testing.assert_allclose(changed, -0.54 * np.asarray(error) - 0.09 * np.asarray(attitude), atol=1e-11)


def test_a_reading_with_a_known_gyro_bias_is_corrected() -> None:
    craft = RigidSpacecraft()
    bias = jnp.array([0.01, -0.02, 0.03])
    known = eqx.tree_at(lambda a: a.gyro_bias, Adjustment.none(3), bias)
    y = jnp.array([0.01, 0.02, -0.01, 0.1, 0.05, -0.02])
    plain = tracking_controller(craft).act(None, jnp.zeros(()), Reading(y, jnp.zeros(3), None))[1]
    biased = Reading(y.at[:3].add(bias), jnp.zeros(3), None)
    corrected = tracking_controller(craft, reconfigure=Unchanged(known)).act(None, jnp.zeros(()), biased)[1]
    np.testing.assert_allclose(corrected, plain, atol=1e-14)
