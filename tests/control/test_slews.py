"""Slews start and end at rest, their rates are derivatives of their angles, and what they need is told."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.control import (
    AngleState,
    QuinticSlews,
    SlewStates,
    TrackingController,
    euler321_rates,
    euler321_rates_inverse,
    euler321_to_quaternion,
    quaternion_to_euler321,
    slew_torque,
    torque_need,
)
from gainful.plants import FlexibleStructure
from gainful.spaces import Quaternion, rotate

PUBLISHED = np.radians([[0.0, 0.0, 0.0], [20.0, 10.0, -15.0]])


@pytest.fixture(scope="module")
def slews() -> QuinticSlews:
    return QuinticSlews(PUBLISHED, duration=30.0, hold=15.0)


def test_angles_and_quaternions_are_one_attitude(rng: np.random.Generator) -> None:
    angles = jnp.asarray(rng.uniform(-1.2, 1.2, 3))
    q = euler321_to_quaternion(angles)
    np.testing.assert_allclose(quaternion_to_euler321(q), angles, atol=1e-14)
    np.testing.assert_allclose(quaternion_to_euler321(-q), angles, atol=1e-14)
    # The body's x axis points where yaw and pitch say.
    _, pitch, yaw = np.asarray(angles)
    ahead = [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)]
    np.testing.assert_allclose(rotate(q, jnp.array([1.0, 0.0, 0.0])), ahead, atol=1e-14)
    # Rates of the angles are those of the quaternion.
    w = jnp.asarray(rng.normal(size=3))
    _, moved = jax.jvp(quaternion_to_euler321, (q,), (Quaternion("q").velocity(q, w),))
    np.testing.assert_allclose(euler321_rates(angles) @ w, moved, atol=1e-12)
    np.testing.assert_allclose(euler321_rates(angles) @ euler321_rates_inverse(angles), np.eye(3), atol=1e-13)


def test_a_state_is_written_in_angles_where_its_quaternion_was(rng: np.random.Generator) -> None:
    angles = jnp.asarray(rng.uniform(-1.0, 1.0, 3))
    numbers = jnp.concatenate([jnp.array([7.0]), euler321_to_quaternion(angles), jnp.array([8.0, 9.0])])
    np.testing.assert_allclose(AngleState(1)(numbers), [7.0, *angles, 8.0, 9.0], atol=1e-14)


def test_slews_go_round_from_rest_to_rest(slews: QuinticSlews) -> None:
    for t, angles in ((0.0, PUBLISHED[0]), (30.0, PUBLISHED[1]), (44.0, PUBLISHED[1]), (75.0, PUBLISHED[0])):
        np.testing.assert_allclose(slews.angles(t), angles, atol=1e-15)
        np.testing.assert_allclose(slews.angle_rates(t), 0.0, atol=1e-15)
        np.testing.assert_allclose(slews.angle_accelerations(t), 0.0, atol=1e-15)
    np.testing.assert_allclose(slews.angles(100.0), slews.angles(10.0), atol=1e-14)
    np.testing.assert_allclose(slews.angles(15.0), 0.5 * PUBLISHED[1], atol=1e-15)
    # 15/8 of the mean rate: 1.25, 0.63 and 0.94 degrees per second.
    np.testing.assert_allclose(np.degrees(slews.angle_rates(15.0)), [1.25, 0.625, -0.9375], rtol=1e-12)


def test_rates_and_accelerations_are_the_derivatives_they_are_called(slews: QuinticSlews) -> None:
    t, h = jnp.linspace(1.0, 88.0, 23), 1e-4
    for function, slope in (
        (slews.angles, slews.angle_rates),
        (slews.angle_rates, slews.angle_accelerations),
        (slews.target_rate, slews.target_acceleration),
    ):
        found = (jax.vmap(function)(t + h) - jax.vmap(function)(t - h)) / (2.0 * h)
        # Third derivatives of at most 60 * 0.35 / 30^3 times h^2 / 6, and rounding over h.
        np.testing.assert_allclose(found, jax.vmap(slope)(t), atol=1e-10)
    q, w = jax.vmap(slews.attitude)(t), jax.vmap(slews.target_rate)(t)
    turned = jax.vmap(Quaternion("q").minus)(jax.vmap(slews.attitude)(t + h), jax.vmap(slews.attitude)(t - h)) / (
        2.0 * h
    )
    assert q.shape == (23, 4)
    np.testing.assert_allclose(turned, w, atol=1e-9)


def test_the_error_of_an_attitude_is_its_turn_from_the_target(slews: QuinticSlews, rng: np.random.Generator) -> None:
    t, turn = jnp.asarray(12.0), jnp.asarray(0.1 * rng.normal(size=3))
    q = Quaternion("q").plus(slews.attitude(t), turn)
    for attitude in (q, quaternion_to_euler321(q)):
        angles, to_body = slews.tracking_error(attitude, t)
        np.testing.assert_allclose(angles, turn, atol=1e-13)
        v = jnp.asarray(rng.normal(size=3))
        np.testing.assert_allclose(rotate(q, to_body @ v), rotate(slews.attitude(t), v), atol=1e-13)


def test_the_torque_fed_forward_keeps_a_rigid_body_on_the_slew(slews: QuinticSlews) -> None:
    J, momentum = jnp.asarray(FlexibleStructure().inertia), jnp.array([1.0, -2.0, 0.5])
    law = TrackingController(J, jnp.eye(3), jnp.asarray(30.0), slews)
    for t in (5.0, 20.0, 50.0):
        now = jnp.asarray(t)
        asked = law.torque(now, slews.target_rate(now), slews.attitude(now), momentum)
        np.testing.assert_allclose(asked, slew_torque(slews, J, now, momentum), atol=1e-12)


def test_states_of_a_slew_have_their_modes_at_rest_in_its_acceleration(slews: QuinticSlews) -> None:
    structure = FlexibleStructure()
    quasi_static = -structure.coupling / structure.modal_stiffness[:, None]
    states = SlewStates(slews, structure.inertia, quasi_static)
    t = jnp.asarray(5.0)
    x = states.state(t)
    bending = structure.modal_stiffness * x[4:7] + structure.coupling @ slews.target_acceleration(t)
    np.testing.assert_allclose(bending, 0.0, atol=1e-12)
    np.testing.assert_allclose(x[:4], slews.attitude(t))
    np.testing.assert_allclose(x[10:], 0.0)
    angles = SlewStates(slews, structure.inertia, quasi_static, "angles").state(t)
    np.testing.assert_allclose(AngleState()(x), angles, atol=1e-14)


def test_what_slews_need_is_told_axis_by_axis(slews: QuinticSlews) -> None:
    inertia = np.diag([3000.0, 1500.0, 2500.0])
    alone = QuinticSlews(np.radians([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]]), 30.0, 15.0)
    need = torque_need(alone, inertia, 30.0)
    # About one axis: 10/sqrt(3) of the angle over the square of the time.
    assert need.needed[0] == pytest.approx(3000.0 * 10.0 / np.sqrt(3.0) * np.radians(20.0) / 900.0, rel=1e-4)
    np.testing.assert_allclose(need.needed[1:], 0.0, atol=1e-12)
    assert need.feasible
    assert need.cautions == ()
    hard = torque_need(alone, inertia, [5.0, 5.0, 5.0])
    assert not hard.feasible
    assert torque_need(QuinticSlews(alone.way_points, 30.0 * hard.longer * 1.0001, 15.0), inertia, 5.0).feasible
    assert not torque_need(QuinticSlews(alone.way_points, 30.0 * hard.longer * 0.99, 15.0), inertia, 5.0).feasible
