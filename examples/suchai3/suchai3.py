"""A tumbling cubesat that knows its turn rates, and the magnetic field around it from a map."""

import jax.numpy as jnp

import gainful as gf
from gainful.spaces import quaternion_exp, quaternion_multiply, rotate

ENTRIES = tuple(f"magnetometer_{row}{column}" for row in "xyz" for column in "xyz")


def move(x, u, t, dt):
    """The attitude turns by the gyro's rates, exactly however fast; the magnetometer stays what it is."""
    return jnp.concatenate([quaternion_multiply(x[:4], quaternion_exp(u[:3] * dt)), x[4:]])


def magnetometer(x, u, t):
    """The field in body axes through a linear sensor: nine numbers for scale, skew and mount, three for its offset [uT]."""
    field = rotate(x[:4] * jnp.array([-1.0, -1.0, -1.0, 1.0]), u[3:6])
    return x[7:16].reshape(3, 3) @ field + x[4:7]


def model(gyro_density=2.5e-6, offset_density=9e-4, magnetometer_sigma=0.25):
    """Attitude and magnetometer, both unknown.

    Args:
        gyro_density: spectral density of the gyro's noise [rad^2/s].
        offset_density: spectral density of the magnetometer's offset [uT^2/s].
        magnetometer_sigma: standard deviation of a reading [uT].
    """

    def noise(x, u, t, dt):
        return dt * jnp.diag(jnp.array([gyro_density] * 3 + [offset_density] * 3 + [0.0] * 9))

    return gf.discrete_model(
        move,
        magnetometer,
        states={"attitude": "quaternion"} | {f"iron_{axis}": "uT" for axis in "xyz"} | dict.fromkeys(ENTRIES, "1"),
        inputs={f"w{axis}": "rad/s" for axis in "xyz"} | {f"field_{axis}": "uT" for axis in "xyz"},
        outputs={f"m{axis}": "uT" for axis in "xyz"},
        Q=noise,
        R=magnetometer_sigma**2,
    )
