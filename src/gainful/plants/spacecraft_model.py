"""A rigid spacecraft turned by reaction wheels: what a filter believes of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..errors import ModelError, did_you_mean
from ..models import Model, discrete_model, forward_euler, runge_kutta_4, sensor
from ..spaces import AbstractSpace, Product, make_space
from .attitude_forms import AbstractAttitudeForm, AttitudeName, attitude_form
from .rigid_spacecraft import (
    FILTER_STEP,
    GYRO_SIGMA,
    INERTIA,
    STAR_TRACKER_SIGMA,
    TORQUE_DENSITY,
    RigidSpacecraft,
    gyro_space,
    inverse_3x3,
)
from .targets import SwingTarget
from .wheels import Wheels, wheel_names

ATTITUDE_DENSITY = 1e-7**2 / FILTER_STEP  # rad^2/s: 1e-7 rad in a sample

StepName = Literal["runge_kutta_4", "euler"]
"""How the motion is carried over an interval."""

_STEPS: dict[str, Callable[..., Array]] = {"runge_kutta_4": runge_kutta_4, "euler": forward_euler}


class _Motion(eqx.Module):
    """Rates and attitude at the end of an interval, the wheels' torque held and their momentum known at its start."""

    inertia: Array
    axes: Array
    form: AbstractAttitudeForm
    attitude: AbstractSpace
    step: str = eqx.field(static=True)

    def cautions(self, x: np.ndarray) -> tuple[str, ...]:
        return self.form.cautions(x[:, 3:])

    def __call__(self, x: Array, u: Array, t: Array, dt: Array) -> Array:
        torque, told = jnp.split(u, 2)
        start, inverse = t - dt, inverse_3x3(self.inertia)
        turning = self.axes @ torque

        def change(z: Array, now: Array) -> Array:
            w, attitude = z[:3], z[3:]
            momentum = self.axes @ (told - torque * (now - start))
            moment = turning - jnp.cross(w, self.inertia @ w + momentum)
            turn = self.attitude.velocity(attitude, self.form.rates(w, attitude, now))
            return jnp.concatenate([inverse @ moment, turn])

        z = _STEPS[self.step](change, x, start, dt)
        return jnp.concatenate([z[:3], self.attitude.plus(z[3:], jnp.zeros(3, z.dtype))])


class _Noise(eqx.Module):
    """Covariance the wheels' white torque and a little white rate of the attitude add over an interval."""

    inertia: Array
    axes: Array
    torque_density: Array
    attitude_density: Array

    def __call__(self, x: Array, u: Array, t: Array, dt: Array) -> Array:
        gain = inverse_3x3(self.inertia) @ self.axes
        zero = jnp.zeros((3, 3))
        rates, angles = self.torque_density * gain @ gain.T, self.attitude_density * jnp.eye(3)
        return dt * jnp.block([[rates, zero], [zero, angles]])


def _rates(x: Array) -> Array:
    return x[:3]


def _attitude(x: Array) -> Array:
    return x[3:]


def spacecraft_model(
    craft: RigidSpacecraft, *, attitude_density: float = ATTITUDE_DENSITY, step: StepName = "runge_kutta_4"
) -> Model:
    """The model of a spacecraft: rates and attitude, turned by the torques applied to its wheels.

    States are the rates `wx, wy, wz` and the attitude in the spacecraft's form: angles `phi, theta, psi` relative to target
    or orbit axes, or the quaternion `attitude`. Inputs are the torque of each wheel, held over the interval and as
    the limits left it, and its momentum measured at the start of the interval: `torque_x, ..., momentum_x, ...` for three
    wheels, numbers for more. The sensors are `gyro` and `star_tracker`.

    Faults are biases: `augment(model, biases={"gyro_x": walk})` for a sensor, `{"torque_x": walk}` for a wheel that adds to
    its command. An input's bias is what it reads too much, so the torque a wheel adds is minus `bias_torque_x`.

    Args:
        craft: the spacecraft; what the environment does to it is not known to the model.
        attitude_density: spectral density of white rate added to the attitude [rad^2/s].
        step: how the motion is carried over an interval, "runge_kutta_4" or "euler", which costs a quarter and lags where
            the wheels turn the spacecraft quickly.

    Raises:
        ModelError: a step of another name.

    Source: Chen, Sun, Wu and Jiang (2019), Acta Aeronautica et Astronautica Sinica 40(5):322551.

    Example:
        >>> spacecraft_model(RigidSpacecraft()).space.names
        ('wx', 'wy', 'wz', 'phi', 'theta', 'psi')
    """
    if step not in _STEPS:
        raise ModelError(f"step: {step!r} is not known; {did_you_mean(str(step), _STEPS)}")
    names = wheel_names(craft.wheels.count)
    attitude, axes = craft.form.space(), craft.wheels.axes
    inputs = {f"torque_{name}": "N*m" for name in names} | {f"momentum_{name}": "N*m*s" for name in names}
    return discrete_model(
        _Motion(craft.inertia, axes, craft.form, attitude, step),
        states=Product([make_space(dict.fromkeys(("wx", "wy", "wz"), "rad/s")), attitude]),
        inputs=inputs,
        Q=_Noise(craft.inertia, axes, jnp.asarray(craft.torque_density), jnp.asarray(attitude_density)),
        sensors=[
            sensor("gyro", _rates, outputs=gyro_space(), R=jnp.full(3, craft.gyro_sigma) ** 2),
            sensor(
                "star_tracker",
                _attitude,
                outputs=craft.form.space("star_"),
                R=jnp.full(3, craft.star_tracker_sigma) ** 2,
            ),
        ],
    )


def rigid_spacecraft(
    attitude: AttitudeName = "target",
    inertia: Any = INERTIA,
    wheel_axes: Any = None,
    orbital_rate: float = 1.1e-3,  # rad/s
    torque_density: float = TORQUE_DENSITY,
    gyro_sigma: float = GYRO_SIGMA,
    star_tracker_sigma: float = STAR_TRACKER_SIGMA,
) -> Model:
    """A spacecraft with wheels, a gyro and a star tracker, that follows a swinging target.

    Args:
        attitude: 3-1-2 angles relative to the "target" or to the "orbit" axes, or the inertial "quaternion".
        inertia: principal moments (3,) or matrix (3, 3) [kg m^2].
        wheel_axes: unit vector of each wheel in body axes (3, w); one wheel along each axis by default.
        orbital_rate: of the orbit axes [rad/s].
        torque_density: spectral density of a wheel's torque noise [(N m)^2 s].
        gyro_sigma: standard deviation of a reading per axis [rad/s].
        star_tracker_sigma: likewise [rad].
    """
    form = attitude_form(attitude, SwingTarget(orbital_rate=orbital_rate))
    sigmas = {"gyro_sigma": gyro_sigma, "star_tracker_sigma": star_tracker_sigma}
    return spacecraft_model(RigidSpacecraft(inertia, Wheels(wheel_axes), form, torque_density=torque_density, **sigmas))
