"""Rotation sequence 3-1-2: its matrix, its rates and its quaternion say the same."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.models import runge_kutta_4
from gainful.plants import (
    dcm_to_euler312,
    euler312_rates,
    euler312_rates_inverse,
    euler312_to_dcm,
    euler312_to_quaternion,
    quaternion_to_dcm,
)
from gainful.plants.rigid_spacecraft import inverse_3x3
from gainful.spaces import Quaternion, quaternion_conjugate, rotate

EPS = np.finfo(float).eps


def about(axis: int, angle: float) -> np.ndarray:
    """Axes turned about one of them, as a matrix from old to new axes."""
    c, s = np.cos(angle), np.sin(angle)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    out = np.eye(3)
    out[[j, j, k, k], [j, k, j, k]] = c, s, -s, c
    return out


@pytest.fixture
def attitudes(rng: np.random.Generator) -> jax.Array:
    """Angles in the whole range, phi up to 85 degrees."""
    most = np.array([1.48, np.pi, np.pi])
    return jnp.asarray(rng.uniform(-most, most, size=(200, 3)))


def test_the_matrix_is_a_turn_about_z_then_x_then_y(attitudes: jax.Array) -> None:
    for angles in np.asarray(attitudes[:20]):
        phi, theta, psi = angles
        expected = about(1, theta) @ about(0, phi) @ about(2, psi)
        np.testing.assert_allclose(euler312_to_dcm(jnp.asarray(angles)), expected, atol=8 * EPS)


def test_angles_of_the_matrix_of_angles_are_the_angles(attitudes: jax.Array) -> None:
    back = jax.vmap(lambda angles: dcm_to_euler312(euler312_to_dcm(angles)))(attitudes)
    # theta and psi lose a factor cos(phi) >= 0.09 of their digits.
    np.testing.assert_allclose(back, attitudes, atol=64 * EPS / 0.09)


def test_angles_have_their_digits_near_the_singularity() -> None:
    angles = jnp.array([np.pi / 2 - 1e-6, 0.4, -0.3])
    assert abs(float((dcm_to_euler312(euler312_to_dcm(angles)) - angles)[0])) < 1e-12  # the arc sine is off by 1e-11


def test_the_rate_matrix_times_its_inverse_is_the_identity(attitudes: jax.Array) -> None:
    both = jax.vmap(lambda angles: euler312_rates(angles) @ euler312_rates_inverse(angles))(attitudes)
    np.testing.assert_allclose(both, np.broadcast_to(np.eye(3), both.shape), atol=1e-12)


def test_the_matrix_of_a_turning_body_changes_by_minus_the_cross_product(attitudes: jax.Array) -> None:
    w = jnp.array([0.3, -0.5, 0.2])  # rad/s
    step = 1e-5  # s: central differences leave step^2 / 6 times the third derivative, and EPS / step

    def change(angles: jax.Array) -> tuple[jax.Array, jax.Array]:
        slope = euler312_rates(angles) @ w
        _, bend = jax.jvp(lambda a: euler312_rates(a) @ w, (angles,), (slope,))
        ahead, behind = (euler312_to_dcm(angles + s * step * slope + 0.5 * step**2 * bend) for s in (1.0, -1.0))
        return (ahead - behind) / (2.0 * step), -jnp.cross(w, euler312_to_dcm(angles).T).T

    gentle = attitudes[jnp.abs(attitudes[:, 0]) < 1.0]
    found, expected = jax.vmap(change)(gentle)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8)


def test_the_quaternion_turns_as_the_matrix_does(attitudes: jax.Array, rng: np.random.Generator) -> None:
    v = jnp.asarray(rng.normal(size=3))
    for angles in attitudes[:20]:
        q = euler312_to_quaternion(angles)
        np.testing.assert_allclose(quaternion_to_dcm(q), euler312_to_dcm(angles), atol=16 * EPS)
        np.testing.assert_allclose(rotate(quaternion_conjugate(q), v), euler312_to_dcm(angles) @ v, atol=64 * EPS)


def test_a_step_of_the_quaternion_is_a_step_of_the_angles() -> None:
    w, dt, space = jnp.array([0.6, -0.5, 0.62]), 0.05, Quaternion("q")  # 1 rad/s, s
    start = jnp.array([0.4, -0.7, 1.1])
    angles = runge_kutta_4(lambda a, t: euler312_rates(a) @ w, start, jnp.zeros(()), jnp.asarray(dt))
    stepped = runge_kutta_4(lambda q, t: space.velocity(q, w), euler312_to_quaternion(start), jnp.zeros(()), dt)
    exact = space.plus(euler312_to_quaternion(start), dt * w)
    for q in (stepped, exact):
        np.testing.assert_allclose(quaternion_to_dcm(q), euler312_to_dcm(angles), atol=1e-6)


def test_an_inverse_by_cross_products_is_the_inverse(rng: np.random.Generator) -> None:
    root = rng.normal(size=(3, 3))
    inertia = root @ root.T + 3.0 * np.eye(3)
    np.testing.assert_allclose(inverse_3x3(jnp.asarray(inertia)), np.linalg.inv(inertia), rtol=0, atol=1e-14)
