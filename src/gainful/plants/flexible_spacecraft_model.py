"""A spacecraft with elastic appendages: what a filter believes of it."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..models import Model, Sensor, continuous_model, sensor
from .flexible_spacecraft import (
    ATTITUDE_SIGMA,
    DEFLECTION_RATE_SIGMA,
    DEFLECTION_SIGMA,
    RATE_SIGMA,
    TORQUE_DENSITY,
    FlexibleSpacecraft,
    sensor_spaces,
    state_space,
)
from .flexible_structure import (
    COUPLING,
    INERTIA,
    MODAL_DAMPING,
    MODAL_MASS,
    MODAL_STIFFNESS,
    FlexibleState,
    FlexibleStructure,
)


class _Motion(eqx.Module):
    structure: FlexibleStructure

    def __call__(self, x: Array, u: Array, t: Array) -> Array:
        return self.structure.rates(FlexibleState.of(x), u)


class _TorqueNoise(eqx.Module):
    """How noise of the torques enters: as accelerations of hub and modes."""

    structure: FlexibleStructure

    def __call__(self, x: Array, u: Array, t: Array) -> Array:
        modes = self.structure.count
        gain = jax.vmap(self.structure.accelerations, in_axes=(1, None), out_axes=1)(jnp.eye(3), jnp.zeros(modes))
        return jnp.concatenate([jnp.zeros((3 + modes, 3)), gain])


class _Part(eqx.Module):
    """One attribute of the state."""

    name: str = eqx.field(static=True)

    def __call__(self, x: Array) -> Array:
        return getattr(FlexibleState.of(x), self.name)


def flexible_spacecraft_model(craft: FlexibleSpacecraft) -> Model:
    """The model of a flexible spacecraft: attitude, modes and their rates, moved by the torques about the body axes.

    States are the quaternion `attitude`, the deflections `mode_1, ...`, the rates `wx, wy, wz` and the rates of the
    deflections `mode_1_rate, ...`. Inputs are the torques `torque_x, torque_y, torque_z`, held over the interval and as the
    limits left them. The sensors are `star_tracker`, `gyro` and, where the spacecraft has them, `deflection` and
    `deflection_rate`.

    Args:
        craft: the spacecraft; what the environment does to it is not known to the model, and can be estimated as a bias of
            the torques, `augment(model, biases={"torque_x": walk})`.

    Source: as `FlexibleStructure`.
    Reduces to: the linear motion of its modes about rest, where nothing turns.

    Example:
        >>> flexible_spacecraft_model(FlexibleSpacecraft()).space.names[4:10]
        ('mode_1', 'mode_2', 'mode_3', 'wx', 'wy', 'wz')
    """
    structure, spaces = craft.structure, sensor_spaces(craft.structure.count, craft.modal_sensors)
    return continuous_model(
        _Motion(structure),
        states=state_space(structure.count),
        inputs=dict.fromkeys(("torque_x", "torque_y", "torque_z"), "N*m"),
        Q=craft.torque_density,
        G=_TorqueNoise(structure),
        sensors=[_sensor(craft, name, space) for name, space in spaces.items()],
        substeps=craft.substeps,
    )


def _sensor(craft: FlexibleSpacecraft, name: str, space: Any) -> Sensor:
    part = {"star_tracker": "attitude", "gyro": "rate"}.get(name, name)
    sigma = jnp.broadcast_to(getattr(craft, f"{part}_sigma"), space.dof)
    return sensor(name, _Part(part), outputs=space, R=sigma**2)


def flexible_spacecraft(
    inertia: Any = INERTIA,
    modal_mass: Any = MODAL_MASS,
    modal_damping: Any = MODAL_DAMPING,
    modal_stiffness: Any = MODAL_STIFFNESS,
    coupling: Any = COUPLING,
    wheel_momentum: Any = (0.0, 0.0, 0.0),
    torque_density: float = TORQUE_DENSITY,
    attitude_sigma: float = ATTITUDE_SIGMA,
    deflection_sigma: Any = DEFLECTION_SIGMA,
    rate_sigma: float = RATE_SIGMA,
    deflection_rate_sigma: Any = DEFLECTION_RATE_SIGMA,
    modal_sensors: bool = True,
) -> Model:
    """A spacecraft with elastic appendages, a star tracker, a gyro and gauges of its modes.

    Args:
        inertia: principal moments (3,) or matrix (3, 3) of the whole, not deflected [kg m^2].
        modal_mass: of each mode (m,) [kg].
        modal_damping: likewise [N s/m].
        modal_stiffness: likewise [N/m].
        coupling: of modes and axes (m, 3), or its diagonal [kg m].
        wheel_momentum: stored in wheels that keep it in body axes (3,) [N m s].
        torque_density: spectral density of the torques' noise [(N m)^2 s].
        attitude_sigma: standard deviation of a reading per axis [rad].
        deflection_sigma: likewise per mode (m,), or one for all [m].
        rate_sigma: likewise per axis [rad/s].
        deflection_rate_sigma: likewise per mode (m,), or one for all [m/s].
        modal_sensors: whether the modes are read.

    Raises:
        ShapeError: numbers of another shape.
        ModelError: numbers that no structure has, such as a mass matrix that is not positive definite.
    """
    structure = FlexibleStructure(inertia, modal_mass, modal_damping, modal_stiffness, coupling, wheel_momentum)
    craft = FlexibleSpacecraft(
        structure,
        torque_density=torque_density,
        attitude_sigma=attitude_sigma,
        deflection_sigma=deflection_sigma,
        rate_sigma=rate_sigma,
        deflection_rate_sigma=deflection_rate_sigma,
        modal_sensors=modal_sensors,
    )
    return flexible_spacecraft_model(craft)
