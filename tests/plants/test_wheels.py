"""Wheels have limits, and their axes span what they should."""

import itertools

import jax.numpy as jnp
import numpy as np

from gainful.plants import Wheels, orthogonal_axes, pyramid_axes


def test_a_torque_within_the_limits_is_left_alone() -> None:
    wheels = Wheels(orthogonal_axes())
    torque = jnp.array([0.1, -0.1, 0.03])
    assert wheels.limit(torque, jnp.zeros(3), 0.01).tolist() == torque.tolist()


def test_a_motor_gives_no_more_than_it_can() -> None:
    wheels = Wheels(pyramid_axes(), max_torque=[0.1, 0.2, 0.3, 0.4])
    assert wheels.limit(jnp.array([1.0, -1.0, 1.0, -1.0]), jnp.zeros(4), 0.01).tolist() == [0.1, -0.2, 0.3, -0.4]


def test_a_full_wheel_takes_no_more_but_gives_back() -> None:
    wheels = Wheels(orthogonal_axes())
    full = jnp.array([2.0, -2.0, 2.0])
    # A torque on the body takes its opposite from the wheel: a negative one would fill a wheel at +2 further.
    assert wheels.limit(jnp.array([-0.05, 0.05, 0.05]), full, 0.01).tolist() == [0.0, 0.0, 0.05]


def test_a_wheel_stops_at_its_limit_and_not_beyond() -> None:
    wheels = Wheels(orthogonal_axes())
    near = jnp.array([1.9995, -1.9995, 0.0])
    torque = wheels.limit(jnp.array([-0.1, 0.1, 0.1]), near, 0.01)
    np.testing.assert_allclose(near - 0.01 * torque, [2.0, -2.0, -0.001], atol=1e-15)


def test_a_wheel_beyond_its_limit_is_not_thrown_back() -> None:
    wheels = Wheels(orthogonal_axes())
    assert wheels.limit(jnp.array([-0.1, 0.02, 0.0]), jnp.array([2.5, 2.5, 2.5]), 0.01).tolist() == [0.0, 0.02, 0.0]


def test_any_three_wheels_of_a_pyramid_span_all_torques_and_all_four_equally() -> None:
    axes = np.asarray(pyramid_axes())
    np.testing.assert_allclose(np.linalg.norm(axes, axis=0), 1.0, atol=1e-15)
    # At 35.26 degrees W W^T is a multiple of the identity.
    np.testing.assert_allclose(axes @ axes.T, 4.0 / 3.0 * np.eye(3), atol=1e-15)
    for three in itertools.combinations(range(4), 3):
        assert abs(np.linalg.det(axes[:, three])) > 0.5
    np.testing.assert_allclose(axes @ [1.0, -1.0, 1.0, -1.0], 0.0, atol=1e-15)
