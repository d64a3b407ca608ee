"""A target's attitude, rate and acceleration belong together."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.plants import InertialQuaternion, OrbitAngles, SlewTarget, SwingTarget, TargetAngles, euler312_to_dcm
from gainful.plants.targets import ORBITAL_RATE, AbstractTarget
from gainful.spaces import Quaternion, quaternion_exp, quaternion_multiply

TARGETS: list[AbstractTarget] = [
    SwingTarget(),
    SlewTarget((np.radians(2.0), 0.0, 0.0)),
    SlewTarget((0.01, 0.02, -0.03)),
]
TIMES = jnp.array([0.0, 3.0, 25.0, 45.0, 71.3, 133.7])  # s; the first slew is through phi = 90 degrees at 45


@pytest.mark.parametrize("target", TARGETS, ids=["swing", "roll", "slew"])
def test_the_rate_turns_the_attitude_and_the_acceleration_changes_the_rate(target: AbstractTarget) -> None:
    step, space = 1e-4, Quaternion("q")  # s

    def differences(t: jax.Array) -> tuple[jax.Array, jax.Array]:
        turned = space.minus(target.attitude(t + step), target.attitude(t - step)) / (2.0 * step)
        return turned, (target.rate(t + step) - target.rate(t - step)) / (2.0 * step)

    rate, acceleration = jax.vmap(differences)(TIMES)
    # Left out: step^2 / 6 times the third derivative, (rate)^3; rounding: eps / step, doubled and in body axes.
    np.testing.assert_allclose(jax.vmap(target.rate)(TIMES), rate, atol=2e-11)
    np.testing.assert_allclose(jax.vmap(target.acceleration)(TIMES), acceleration, atol=2e-12)


def test_the_orbit_axes_turn_about_minus_y() -> None:
    target = SwingTarget()
    quarter = jnp.asarray(0.5 * np.pi / ORBITAL_RATE)
    half = np.sqrt(0.5)
    np.testing.assert_allclose(target.orbit(quarter), [0.0, -half, 0.0, half], atol=1e-15)
    np.testing.assert_allclose(target.orbit(jnp.zeros(())), [0.0, 0.0, 0.0, 1.0], atol=0)


def test_every_form_of_an_attitude_tells_the_same_error() -> None:
    t, error = jnp.asarray(37.0), jnp.array([0.03, -0.02, 0.5])
    target = SwingTarget()
    from_error = TargetAngles(target).tracking_error(error, t)
    np.testing.assert_allclose(from_error[1], euler312_to_dcm(error), atol=0)
    turn = jnp.asarray([1.0, 0.0, 0.0, 0.0])
    for axis, angle in zip((1, 0, 2), (error[1], error[0], error[2]), strict=True):
        own = quaternion_exp(angle * jnp.eye(3)[axis])
        turn = own if axis == 1 else quaternion_multiply(own, turn)
    q = quaternion_multiply(target.attitude(t), turn)
    for form in (TargetAngles(target), OrbitAngles(target), InertialQuaternion(target)):
        angles, to_body = form.tracking_error(form.written(q, t), t)
        np.testing.assert_allclose(angles, error, atol=1e-14)
        np.testing.assert_allclose(to_body, from_error[1], atol=1e-14)
