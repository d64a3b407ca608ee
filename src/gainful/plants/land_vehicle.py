"""A land vehicle in the plane: inertial navigation with biases, odometer, no side slip, compass and satellite fixes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ModelError
from ..models import Model, discrete_model, sensor
from .land_vehicle_errors import compass_deviation, lateral_speed, odometer_error

INTERVAL = 0.1  # s
"""Interval to which the process noise belongs."""
SENSORS = ("odometer", "sideways", "compass", "gnss")
GNSS = ("gnss_east", "gnss_velocity_east", "gnss_north", "gnss_velocity_north")
START_SIGMAS = (2.0, 2.0, 0.1, 0.1, math.radians(10.0), 0.1, 0.1, math.radians(0.3), 0.03)
"""Standard deviations of the states where a filter starts from a satellite fix and a poor compass."""

_VELOCITY_NOISE = 0.018 * INTERVAL**2  # m^2/s^2
_HEADING_NOISE = (math.radians(0.15) * INTERVAL) ** 2  # rad^2
_ACCELERATION_WALK = 1.6e-7  # m^2/s^4
_GYRO_WALK = math.radians(0.0015) ** 2  # rad^2/s^2
_SCALE_WALK = 1e-10
PROCESS_VARIANCES = (
    0.0,
    0.0,
    _VELOCITY_NOISE,
    _VELOCITY_NOISE,
    _HEADING_NOISE,
    _ACCELERATION_WALK,
    _ACCELERATION_WALK,
    _GYRO_WALK,
    _SCALE_WALK,
)
"""Process noise of the states over 0.1 s."""


def to_east_north(heading: Float[Array, ""], forward: Float[Array, ""], right: Float[Array, ""]) -> Float[Array, "2"]:
    """A vector of vehicle axes in east and north; heading counts clockwise from north."""
    s, c = jnp.sin(heading), jnp.cos(heading)
    return jnp.stack([forward * s + right * c, forward * c - right * s])


def to_forward_right(heading: Float[Array, ""], east: Float[Array, ""], north: Float[Array, ""]) -> Float[Array, "2"]:
    """A vector of east and north in vehicle axes."""
    s, c = jnp.sin(heading), jnp.cos(heading)
    return jnp.stack([east * s + north * c, east * c - north * s])


def _transition(x: Array, u: Array, t: Array, dt: Array) -> Array:
    # The heading before the step turns the specific force, and the velocity after it moves the position.
    velocity = x[2:4] + to_east_north(x[4], u[0] - x[5], u[1] - x[6]) * dt
    return jnp.concatenate([x[:2] + velocity * dt, velocity, (x[4] + (u[2] - x[7]) * dt)[None], x[5:]])


class _Process(eqx.Module):
    """Covariance of the process noise, in proportion to the interval."""

    variances: Float[Array, "9"]

    def __call__(self, x: Array, u: Array, t: Array, dt: Array) -> Array:
        return jnp.diag(self.variances) * dt / INTERVAL


def _odometer(x: Array, u: Array, t: Array) -> Array:
    return (1.0 + x[8]) * to_forward_right(x[4], x[2], x[3])[:1]


def _sideways(x: Array, u: Array, t: Array) -> Array:
    return to_forward_right(x[4], x[2], x[3])[1:]


def _compass(x: Array, u: Array, t: Array) -> Array:
    return x[4:5]


def _odometer_as_it_errs(x: Array, u: Array, t: Array) -> Array:
    plain = _odometer(x, u, t)
    return plain + odometer_error(plain, u[:1])


def _sideways_as_it_errs(x: Array, u: Array, t: Array) -> Array:
    return _sideways(x, u, t) - lateral_speed(_odometer(x, u, t), u[2:3])


def _compass_as_it_errs(x: Array, u: Array, t: Array) -> Array:
    return x[4:5] + compass_deviation(x[4:5])


def _gnss(x: Array, u: Array, t: Array) -> Array:
    return x[jnp.array([0, 2, 1, 3])]


def land_vehicle(
    odometer_sigma: float = 0.15,
    sideways_sigma: float = 0.3,
    compass_sigma_deg: float = 6.0,
    gnss_sigmas: Sequence[float] = (1.3, 0.1),
    process_variances: Sequence[float] = PROCESS_VARIANCES,
    *,
    errors_known: bool = False,
) -> Model:
    """A land vehicle in the plane, driven by measured specific force and yaw rate.

    ```
    v <- v + C(heading) (f - bias) dt,  p <- p + v dt,  heading <- heading + (w - bias) dt
    odometer = (1 + scale) forward speed;  sideways = 0 = speed to the right;  compass = heading;  gnss = p and v
    ```

    That a wheeled vehicle does not move sideways is a measurement of 0 with some noise. Sensors that come at other rates
    are left out of the rows in between.

    Args:
        odometer_sigma: [m/s].
        sideways_sigma: of the speed to the right that is taken to be 0 [m/s].
        compass_sigma_deg: [deg].
        gnss_sigmas: of position [m] and velocity [m/s].
        process_variances: of the nine states, over 0.1 s; they grow with the interval.
        errors_known: whether the repeatable errors of the sensors of `drive_vehicle` are in the model, as the best map of
            them would have them.

    Raises:
        ModelError: a number of sigmas or variances that is not the one expected.

    Source: Groves (2013), Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed., 5, 15.4, 16.3.

    Example:
        >>> land_vehicle().space.names
        ('east', 'north', 'v_east', 'v_north', 'heading', 'bias_forward', 'bias_right', 'bias_gyro', 'odometer_scale')
    """
    for name, values, count in (("gnss_sigmas", gnss_sigmas, 2), ("process_variances", process_variances, 9)):
        if len(values) != count:
            raise ModelError(f"{name}: expected {count} numbers, got {len(values)}")
    position, velocity = gnss_sigmas
    odometer, sideways, compass = (
        (_odometer_as_it_errs, _sideways_as_it_errs, _compass_as_it_errs)
        if errors_known
        else (_odometer, _sideways, _compass)
    )
    return discrete_model(
        _transition,
        states={
            "east": "m",
            "north": "m",
            "v_east": "m/s",
            "v_north": "m/s",
            "heading": "angle",
            "bias_forward": "m/s^2",
            "bias_right": "m/s^2",
            "bias_gyro": "rad/s",
            "odometer_scale": "1",
        },
        inputs={"force_forward": "m/s^2", "force_right": "m/s^2", "yaw_rate": "rad/s"},
        Q=_Process(jnp.asarray(process_variances, float)),
        sensors=[
            sensor("odometer", odometer, outputs={"odometer": "m/s"}, R=odometer_sigma**2),
            sensor("sideways", sideways, outputs={"sideways": "m/s"}, R=sideways_sigma**2),
            sensor("compass", compass, outputs={"compass": "angle"}, R=math.radians(compass_sigma_deg) ** 2),
            sensor(
                "gnss",
                _gnss,
                outputs=dict(zip(GNSS, ("m", "m/s", "m", "m/s"), strict=True)),
                R=[position**2, velocity**2, position**2, velocity**2],
            ),
        ],
    )
