"""Bodies that move as geometry says, pushed by noise or by measured rates."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..errors import ModelError
from ..models import Model, continuous_model, linear_model, sensor


def _constant_velocity_transition(x: Array, u: Array, t: Array, dt: Array) -> Array:
    n = x.shape[0] // 2
    identity, zero = jnp.eye(n), jnp.zeros((n, n))
    return jnp.block([[identity, dt * identity], [zero, identity]])


class _WhiteAcceleration(eqx.Module):
    """Covariance of white acceleration of a given density over a step."""

    density: Array

    def __call__(self, x: Array, u: Array, t: Array, dt: Array) -> Array:
        n = x.shape[0] // 2
        corner = jnp.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]) * self.density
        return jnp.kron(corner, jnp.eye(n))


def constant_velocity(axes: int = 2, acceleration_density: float = 1.0, position_sigma: float = 1.0) -> Model:
    """A point that keeps its velocity but for white acceleration, measured in position.

    Args:
        axes: 1, 2 or 3.
        acceleration_density: spectral density of the acceleration [m^2/s^3].
        position_sigma: standard deviation of a position fix [m].

    Raises:
        ModelError: a number of axes other than these, or a negative density.

    Source: Bar-Shalom, Li and Kirubarajan (2001), Estimation with Applications to Tracking and Navigation, 6.2.2.
    """
    if axes not in (1, 2, 3):
        raise ModelError(f"axes: expected 1, 2 or 3, got {axes!r}")
    if not acceleration_density >= 0:
        raise ModelError(f"acceleration_density: expected at least 0, got {acceleration_density!r}")
    names = "xyz"[:axes]
    states = dict.fromkeys(names, "m") | {f"v{name}": "m/s" for name in names}
    return linear_model(
        _constant_velocity_transition,
        jnp.eye(axes, 2 * axes),
        states=states,
        outputs={f"measured_{name}": "m" for name in names},
        Q=_WhiteAcceleration(jnp.asarray(acceleration_density, dtype=float)),
        R=jnp.eye(axes) * position_sigma**2,
    )


def _planar_rate(x: Array, u: Array, t: Array) -> Array:
    return jnp.array([u[0] * jnp.cos(x[2]), u[0] * jnp.sin(x[2]), u[1]])


def _planar_noise_input(x: Array, u: Array, t: Array) -> Array:
    return jnp.array([[jnp.cos(x[2]), 0.0], [jnp.sin(x[2]), 0.0], [0.0, 1.0]])


def _first_two(x: Array, u: Array, t: Array) -> Array:
    return x[:2]


def planar_vehicle(speed_density: float = 0.01, turn_density: float = 1e-4, position_sigma: float = 1.0) -> Model:
    """A vehicle in the plane, driven by measured speed and turn rate, with position fixes; heading counts from x to y.

    Args:
        speed_density: spectral density of the speed's noise [m^2/s].
        turn_density: spectral density of the turn rate's noise [rad^2/s].
        position_sigma: standard deviation of a position fix [m].
    """
    return continuous_model(
        _planar_rate,
        _first_two,
        states={"x": "m", "y": "m", "heading": "angle"},
        inputs={"speed": "m/s", "turn_rate": "rad/s"},
        outputs={"measured_x": "m", "measured_y": "m"},
        Q=[speed_density, turn_density],
        G=_planar_noise_input,
        R=position_sigma**2,
    )


def _body_rate(x: Array, u: Array, t: Array) -> Array:
    return u


def _attitude(x: Array, u: Array, t: Array) -> Array:
    return x[:4]


def attitude_kinematics(gyro_density: float = 1e-10, attitude_sigma: float = 1e-4) -> Model:
    """An attitude turned by measured body rates and measured as a quaternion (body to reference, scalar last).

    Add `augment(model, biases={"wx": walk, "wy": walk, "wz": walk})` to estimate the gyro's bias.

    Args:
        gyro_density: spectral density of the gyro's white noise [rad^2/s].
        attitude_sigma: standard deviation of the measured attitude per axis [rad].

    Source: Markley (2003), J. Guid. Control Dyn. 26(2):311-317.
    """
    star_tracker = sensor("star_tracker", _attitude, outputs={"measured": "quaternion"}, R=attitude_sigma**2)
    return continuous_model(
        _body_rate,
        states={"attitude": "quaternion"},
        inputs={"wx": "rad/s", "wy": "rad/s", "wz": "rad/s"},
        Q=gyro_density,
        sensors=[star_tracker],
    )
