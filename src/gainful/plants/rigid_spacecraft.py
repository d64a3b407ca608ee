"""A rigid spacecraft turned by reaction wheels: the truth."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ShapeError
from ..models import runge_kutta_4
from ..running.plant import AbstractPlant
from ..spaces import AbstractSpace, Product, Quaternion, make_space, quaternion_multiply
from .attitude_forms import AbstractAttitudeForm, TargetAngles
from .euler312 import euler312_to_dcm, euler312_to_quaternion
from .targets import SwingTarget
from .wheels import Wheels

INERTIA = (17.0, 12.0, 10.0)  # kg m^2
DEGREE = jnp.pi / 180.0  # rad
FILTER_STEP = 0.05  # s; noise levels are published for samples this far apart
TORQUE_DENSITY = 5e-4**2 * FILTER_STEP  # (N m)^2 s: 5e-4 N m in a sample
GYRO_SIGMA = 0.005 * DEGREE  # rad/s
STAR_TRACKER_SIGMA = 0.01 * DEGREE  # rad
START_ERROR = (2.0 * DEGREE, -1.0 * DEGREE, 1.0 * DEGREE)  # rad


class SpacecraftState(eqx.Module):
    """The true state.

    Attributes:
        rate: inertial rate in body axes [rad/s].
        attitude: quaternion from body axes to inertial axes, scalar last.
        momentum: of the wheels, each about its own axis [N m s] (w,).
    """

    rate: Float[Array, "3"]
    attitude: Float[Array, "4"]
    momentum: Float[Array, " w"]


class RigidSpacecraft(AbstractPlant):
    """A rigid body with wheels, a gyro and a star tracker, moved by Runge-Kutta 4 in each step of the simulation.

    With `W` the wheels' axes, `T` their torques and `h` their momentum, `d` what the environment does,

        J dw/dt = -w x (J w + W h) + W T + d,    dh/dt = -T,    dq/dt = q (w, 0) / 2

    Torques carry white noise; a wheel's torque, whatever its cause, never takes its momentum beyond the limit.

    Attributes:
        inertia: J (3, 3) [kg m^2]; a vector is its diagonal.
        wheels: their axes and limits.
        form: how the attitude is written in readings and in the model's state, and the target it may refer to.
        torque_density: spectral density of a wheel's torque noise [(N m)^2 s].
        gyro_sigma: standard deviation of a reading per axis [rad/s].
        star_tracker_sigma: likewise [rad].
        disturbance: amplitude of the environment's torque, at the orbital rate and twice that [N m].
        start_error: angles relative to the target at time 0, where the rate is the target's [rad].

    Source: Chen, Sun, Wu and Jiang (2019), Acta Aeronautica et Astronautica Sinica 40(5):322551.
    Differs: the truth is integrated as a quaternion relative to inertial axes, whatever form is read.

    Example:
        >>> craft = RigidSpacecraft()
        >>> (craft.truth(craft.init(), jnp.zeros(()))[3:] / DEGREE).round(9).tolist()
        [2.0, -1.0, 1.0]
    """

    inertia: Float[Array, "3 3"]
    wheels: Wheels
    form: AbstractAttitudeForm
    torque_density: float | Array
    gyro_sigma: float | Array
    star_tracker_sigma: float | Array
    disturbance: float | Array
    start_error: Float[Array, "3"]
    output: AbstractSpace

    def __init__(
        self,
        inertia: Any = INERTIA,
        wheels: Wheels | None = None,
        form: AbstractAttitudeForm | None = None,
        *,
        torque_density: float | Array = TORQUE_DENSITY,
        gyro_sigma: float | Array = GYRO_SIGMA,
        star_tracker_sigma: float | Array = STAR_TRACKER_SIGMA,
        disturbance: float | Array = 1e-5,  # N m
        start_error: Any = START_ERROR,
    ) -> None:
        self.inertia = inertia_matrix(inertia)
        self.wheels = Wheels() if wheels is None else wheels
        self.form = TargetAngles(SwingTarget()) if form is None else form
        self.torque_density, self.disturbance = torque_density, disturbance
        self.gyro_sigma, self.star_tracker_sigma = gyro_sigma, star_tracker_sigma
        self.start_error = jnp.asarray(start_error, float)
        if self.start_error.shape != (3,):
            raise ShapeError(f"start_error: expected 3 angles, got shape {self.start_error.shape}")
        self.output = Product([gyro_space(), self.form.space("star_")])

    def init(self) -> SpacecraftState:
        t = jnp.zeros(())
        attitude = quaternion_multiply(self.form.target.attitude(t), euler312_to_quaternion(self.start_error))
        rate = euler312_to_dcm(self.start_error) @ self.form.target.rate(t)
        return SpacecraftState(rate, attitude, jnp.zeros(self.wheels.count))

    def limit(self, state: SpacecraftState, command: Float[Array, " w"], dt: float) -> Float[Array, " w"]:
        return self.wheels.limit(command, state.momentum, dt)

    def advance(
        self, state: SpacecraftState, actuation: Float[Array, " w"], t: Float[Array, ""], dt: float, key: Array
    ) -> SpacecraftState:
        noise = jnp.sqrt(self.torque_density / dt) * jax.random.normal(key, actuation.shape)
        torque = self.wheels.saturated(actuation + noise, state.momentum, dt)
        axes, inverse = self.wheels.axes, inverse_3x3(self.inertia)
        turning, space = axes @ torque, Quaternion("attitude")

        def change(z: Array, now: Array) -> Array:
            w, q = z[:3], z[3:]
            momentum = axes @ (state.momentum - torque * (now - t))
            moment = turning + self.disturbance_torque(now) - jnp.cross(w, self.inertia @ w + momentum)
            return jnp.concatenate([inverse @ moment, space.velocity(q, w)])

        z = runge_kutta_4(change, jnp.concatenate([state.rate, state.attitude]), t, jnp.asarray(dt))
        return SpacecraftState(z[:3], space.plus(z[3:], jnp.zeros(3)), state.momentum - torque * dt)

    def disturbance_torque(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        """What the environment does [N m]."""
        phase = self.form.target.orbital_rate * t
        return self.disturbance * jnp.stack([jnp.sin(phase), jnp.cos(phase), jnp.sin(2.0 * phase)])

    def read(self, state: SpacecraftState, t: Float[Array, ""], key: Array) -> Float[Array, " output_size"]:
        normal = jax.random.normal(key, (6,))
        sigma = jnp.repeat(jnp.stack([jnp.asarray(self.gyro_sigma), jnp.asarray(self.star_tracker_sigma)]), 3)
        return self.output.plus(self.truth(state, t), sigma * normal)

    def monitor(self, state: SpacecraftState) -> Float[Array, " w"]:
        return state.momentum

    def inputs(self, monitored: Float[Array, " w"], applied: Float[Array, " w"]) -> Float[Array, " inputs"]:
        return jnp.concatenate([applied, monitored])

    def truth(self, state: SpacecraftState, t: Float[Array, ""]) -> Float[Array, " size"]:
        return jnp.concatenate([state.rate, self.form.written(state.attitude, t)])


def gyro_space() -> AbstractSpace:
    """Where a gyro's reading lives."""
    return make_space({f"gyro_{axis}": "rad/s" for axis in "xyz"})


def inertia_matrix(given: Any) -> Float[Array, "3 3"]:
    """A matrix of inertia from three principal moments or from the matrix itself [kg m^2]."""
    inertia = jnp.asarray(given, float)
    if inertia.shape not in ((3,), (3, 3)):
        raise ShapeError(f"inertia: expected shape (3,) or (3, 3), got {inertia.shape}")
    return jnp.diag(inertia) if inertia.ndim == 1 else inertia


def inverse_3x3(matrix: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """The inverse by cross products: no call into a library inside a loop."""
    columns = matrix.T
    rows = jnp.stack([jnp.cross(columns[(k + 1) % 3], columns[(k + 2) % 3]) for k in range(3)])
    return rows / (columns[0] @ rows[0])
