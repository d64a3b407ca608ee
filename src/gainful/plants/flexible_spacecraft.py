"""A spacecraft with elastic appendages, turned by torques about its axes: the truth."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, ShapeError
from ..models import runge_kutta_4
from ..running.plant import AbstractPlant
from ..spaces import AbstractSpace, Product, Quaternion, make_space
from .flexible_structure import FlexibleState, FlexibleStructure
from .rigid_spacecraft import gyro_space

SUBSTEPS = 4
"""Runge-Kutta steps per interval; at 0.1 s the fastest mode of the default structure loses 4e-7 of its energy in each."""
MAX_TORQUE = 30.0  # N m
TORQUE_DENSITY = 0.01**2 * 0.1  # (N m)^2 s: 0.01 N m in a sample of 0.1 s
ATTITUDE_SIGMA = 2e-5  # rad
DEFLECTION_SIGMA = (1e-4, 1e-6, 1e-5)  # m
RATE_SIGMA = 1e-5  # rad/s
DEFLECTION_RATE_SIGMA = (2e-4, 6e-6, 6e-5)  # m/s


def _vector(value: Any) -> Array:
    return jnp.asarray(value, float)


class DisturbanceTorque(eqx.Module):
    """What the environment does to the hub: `constant + swing sin(2 pi t / period) + drift t`.

    Attributes:
        constant: about each axis [N m].
        swing: amplitudes likewise [N m].
        drift: likewise [N m/s].
        period: of the swing [s].

    Raises:
        ShapeError: not one number per axis.

    Example:
        >>> DisturbanceTorque(constant=[0.3, -0.2, 0.25], drift=[0.0, 0.1, 0.0])(jnp.asarray(2.0)).tolist()
        [0.3, 0.0, 0.25]
    """

    constant: Array = eqx.field(converter=_vector, default=(0.0, 0.0, 0.0))
    swing: Array = eqx.field(converter=_vector, default=(0.0, 0.0, 0.0))
    drift: Array = eqx.field(converter=_vector, default=(0.0, 0.0, 0.0))
    period: float | Array = 60.0  # s

    def __check_init__(self) -> None:
        for name in ("constant", "swing", "drift"):
            if getattr(self, name).shape != (3,):
                raise ShapeError(f"{name}: expected 3 torques, got shape {getattr(self, name).shape}")

    def __call__(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        """The torque at a time [N m]."""
        return self.constant + self.swing * jnp.sin(2.0 * jnp.pi * t / self.period) + self.drift * t


class FlexibleSpacecraft(AbstractPlant):
    """A flexible structure under limited torques, with a star tracker, a gyro and gauges of its modes.

    The command is a torque about each body axis, held over a step of the simulation together with white noise. The motion
    is integrated by Runge-Kutta 4, the attitude as a quaternion.

    Attributes:
        structure: masses, modes and coupling.
        start: the state at time 0; at rest by default.
        disturbance: what the environment does; nothing by default.
        max_torque: largest torque about each axis (3,) [N m].
        torque_density: spectral density of the torque's noise [(N m)^2 s].
        attitude_sigma: standard deviation of a reading per axis [rad].
        deflection_sigma: likewise per mode (m,) [m].
        rate_sigma: likewise per axis [rad/s].
        deflection_rate_sigma: likewise per mode (m,) [m/s].
        modal_sensors: whether the modes are read; if not, attitude and rate are all there is.
        substeps: Runge-Kutta steps per step of the simulation.

    Raises:
        ShapeError: limits or deviations of another shape, or a start with another number of modes.
        ConfigError: substeps that are not a whole number above 0.

    Source: as `FlexibleStructure`; limits and deviations are chosen.
    Reduces to: `RigidSpacecraft` with wheels that keep their momentum, with `coupling` zero.

    Example:
        >>> craft = FlexibleSpacecraft()
        >>> craft.limit(craft.init(), jnp.array([50.0, -1.0, 0.0]), 0.1).tolist()
        [30.0, -1.0, 0.0]
    """

    structure: FlexibleStructure
    start: FlexibleState
    disturbance: DisturbanceTorque
    max_torque: Float[Array, "3"]
    torque_density: float | Array
    attitude_sigma: float | Array
    deflection_sigma: Float[Array, " m"]
    rate_sigma: float | Array
    deflection_rate_sigma: Float[Array, " m"]
    output: AbstractSpace
    modal_sensors: bool = eqx.field(static=True)
    substeps: int = eqx.field(static=True)

    def __init__(
        self,
        structure: FlexibleStructure | None = None,
        start: FlexibleState | None = None,
        disturbance: DisturbanceTorque | None = None,
        *,
        max_torque: Any = MAX_TORQUE,
        torque_density: float | Array = TORQUE_DENSITY,
        attitude_sigma: float | Array = ATTITUDE_SIGMA,
        deflection_sigma: Any = DEFLECTION_SIGMA,
        rate_sigma: float | Array = RATE_SIGMA,
        deflection_rate_sigma: Any = DEFLECTION_RATE_SIGMA,
        modal_sensors: bool = True,
        substeps: int = SUBSTEPS,
    ) -> None:
        if not isinstance(substeps, int) or substeps < 1:
            raise ConfigError(f"substeps: expected a whole number of at least 1, got {substeps!r}")
        self.structure = FlexibleStructure() if structure is None else structure
        modes = self.structure.count
        self.start = FlexibleState.at_rest(modes) if start is None else start
        for name, size in (("attitude", 4), ("deflection", modes), ("rate", 3), ("deflection_rate", modes)):
            shape = jnp.shape(getattr(self.start, name))
            if shape != (size,):
                raise ShapeError(f"start.{name}: expected shape ({size},), got {shape}")
        self.disturbance = DisturbanceTorque() if disturbance is None else disturbance
        self.max_torque = _each("max_torque", max_torque, 3)
        self.deflection_sigma = _each("deflection_sigma", deflection_sigma, modes)
        self.deflection_rate_sigma = _each("deflection_rate_sigma", deflection_rate_sigma, modes)
        self.torque_density, self.attitude_sigma, self.rate_sigma = torque_density, attitude_sigma, rate_sigma
        self.modal_sensors, self.substeps = modal_sensors, substeps
        self.output = Product(list(sensor_spaces(modes, modal_sensors).values()))

    def init(self) -> FlexibleState:
        return self.start

    def limit(self, state: FlexibleState, command: Float[Array, "3"], dt: float) -> Float[Array, "3"]:
        return jnp.clip(command, -self.max_torque, self.max_torque)

    def advance(
        self, state: FlexibleState, actuation: Float[Array, "3"], t: Float[Array, ""], dt: float, key: Array
    ) -> FlexibleState:
        torque = actuation + jnp.sqrt(self.torque_density / dt) * jax.random.normal(key, (3,))
        space, h = state_space(self.structure.count), jnp.asarray(dt) / self.substeps

        def change(z: Array, now: Array) -> Array:
            return space.velocity(z, self.structure.rates(FlexibleState.of(z), torque + self.disturbance(now)))

        def move(k: Array, z: Array) -> Array:
            return space.plus(runge_kutta_4(change, z, t + k * h, h), jnp.zeros(space.dof))

        # A loop, not a copy per substep: it compiles in a fifth of the time.
        return FlexibleState.of(jax.lax.fori_loop(0, self.substeps, move, state.coordinates))

    def read(self, state: FlexibleState, t: Float[Array, ""], key: Array) -> Float[Array, " output_size"]:
        sigmas = [jnp.broadcast_to(self.attitude_sigma, 3), jnp.broadcast_to(self.rate_sigma, 3)]
        point = [state.attitude, state.rate]
        if self.modal_sensors:
            sigmas = [sigmas[0], self.deflection_sigma, sigmas[1], self.deflection_rate_sigma]
            point = [state.coordinates]
        sigma = jnp.concatenate(sigmas)
        return self.output.plus(jnp.concatenate(point), sigma * jax.random.normal(key, sigma.shape))

    def monitor(self, state: FlexibleState) -> Float[Array, "3"]:
        return self.structure.wheel_momentum

    def inputs(self, monitored: Float[Array, "3"], applied: Float[Array, "3"]) -> Float[Array, "3"]:
        return applied

    def truth(self, state: FlexibleState, t: Float[Array, ""]) -> Float[Array, " size"]:
        return state.coordinates


def _each(name: str, given: Any, count: int) -> Array:
    value = jnp.asarray(given, float)
    if value.shape not in ((), (count,)):
        raise ShapeError(f"{name}: expected one number or {count}, got shape {value.shape}")
    return jnp.broadcast_to(value, (count,))


def state_space(modes: int) -> AbstractSpace:
    """Where the state of a flexible spacecraft lives."""
    bending = {f"mode_{k + 1}": "m" for k in range(modes)}
    bending_rate = {f"mode_{k + 1}_rate": "m/s" for k in range(modes)}
    turning = {f"w{axis}": "rad/s" for axis in "xyz"}
    return Product([Quaternion("attitude"), *(make_space(part) for part in (bending, turning, bending_rate))])


def sensor_spaces(modes: int, modal_sensors: bool) -> dict[str, AbstractSpace]:
    """Where each sensor's reading lives, in the order of the state."""
    spaces: dict[str, AbstractSpace] = {"star_tracker": Quaternion("star")}
    if modal_sensors:
        spaces["deflection"] = make_space({f"gauge_{k + 1}": "m" for k in range(modes)})
    spaces["gyro"] = gyro_space()
    if modal_sensors:
        spaces["deflection_rate"] = make_space({f"gauge_{k + 1}_rate": "m/s" for k in range(modes)})
    return spaces
