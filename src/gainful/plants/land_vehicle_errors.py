"""What a land vehicle's sensors do wrong every time, by context: the truth that a map can learn."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float


def odometer_error(speed: Float[Array, "..."], acceleration: Float[Array, "..."]) -> Float[Array, "..."]:
    """What an odometer reads too much [m/s]: a scale that depends on the speed [m/s], slip with the acceleration [m/s^2]."""
    return speed * (0.02 + 0.02 * jnp.sin(speed / 4.0)) - 0.05 * acceleration


def lateral_speed(speed: Float[Array, "..."], yaw_rate: Float[Array, "..."]) -> Float[Array, "..."]:
    """Speed to the right where the inertial unit sits [m/s]: a lever arm and the slip of the tyres, from speed [m/s] and yaw
    rate [rad/s]."""
    return (1.3 - 0.006 * speed**2) * yaw_rate


def compass_deviation(heading: Float[Array, "..."]) -> Float[Array, "..."]:
    """What a compass in a vehicle of iron reads too much at a heading [rad]."""
    s, c = jnp.sin, jnp.cos
    return jnp.radians(2.0 + 4.0 * s(heading) - 3.0 * c(heading) + 2.0 * s(2.0 * heading) + c(2.0 * heading))
