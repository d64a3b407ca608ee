"""Attitude from a gyro, an accelerometer and a magnetometer, against east, north and up."""

import jax.numpy as jnp

import gainful as gf
from gainful.spaces import quaternion_conjugate, quaternion_exp, quaternion_multiply, rotate

GRAVITY = 9.81  # m/s^2


def turn(x, u, t, dt):
    """The attitude turns by the gyro's rates, exactly however fast."""
    return quaternion_multiply(x, quaternion_exp(u * dt))


def accelerometer(x, u, t):
    """Specific force at rest, upwards, seen from the body [m/s^2]; what the body accelerates by counts as noise."""
    return rotate(quaternion_conjugate(x), jnp.array([0.0, 0.0, GRAVITY]))


def magnetometer(x, u, t, p):
    """The Earth's field, northwards and down, seen from the body [uT]."""
    field = p["north"] * jnp.array([0.0, 1.0, 0.0]) - p["down"] * jnp.array([0.0, 0.0, 1.0])
    return rotate(quaternion_conjugate(x), field)


def model(gyro_density=1.03e-8, accelerometer_sigma=0.5, magnetometer_sigma=1.0, north=15.8, down=41.0):
    """Attitude, from body axes to east, north and up.

    Args:
        gyro_density: spectral density of the gyro's noise [rad^2/s]; by default its scatter at rest, 1.7e-3 rad/s at 286 Hz.
        accelerometer_sigma: standard deviation of a reading, motion included [m/s^2].
        magnetometer_sigma: standard deviation of a reading [uT].
        north: horizontal part of the field [uT].
        down: vertical part [uT].
    """

    def noise(x, u, t, dt):
        return dt * gyro_density * jnp.eye(3)

    return gf.discrete_model(
        turn,
        states={"attitude": "quaternion"},
        inputs={f"w{axis}": "rad/s" for axis in "xyz"},
        Q=noise,
        sensors=[
            gf.sensor(
                "accelerometer",
                accelerometer,
                outputs={f"a{axis}": "m/s^2" for axis in "xyz"},
                R=accelerometer_sigma**2,
            ),
            gf.sensor(
                "magnetometer", magnetometer, outputs={f"m{axis}": "uT" for axis in "xyz"}, R=magnetometer_sigma**2
            ),
        ],
        parameters={"north": north, "down": down},
    )
