"""A car in the plane: satellite fixes, wheel speed and a gyro, each at its own rate."""

import jax.numpy as jnp

import gainful as gf


def rate(x, u, t, p):
    """The car drives along its course (clockwise from north) and turns at the gyro's rate; speed wanders."""
    speed, direction = x[3], x[2] + p["mount"]
    turn = u[0] / (1.0 + p["gyro_scale"])
    return jnp.array([speed * jnp.sin(direction), speed * jnp.cos(direction), turn, 0.0])


def position(x, u, t):
    """East and north [m]."""
    return x[:2]


def course(x, u, t, p):
    """Direction of motion [rad]: the heading the phone sees, turned by the angle of its mount."""
    return x[2:3] + p["mount"]


def wheel(x, u, t, p):
    """Wheel speed [m/s]."""
    return (1.0 + p["wheel_scale"]) * x[3:4]


def model(position_sigma=0.15, course_sigma=0.007, wheel_sigma=0.03, acceleration_density=1.0, turn_density=1e-5):
    """The car with three sensors.

    Args:
        position_sigma: standard deviation of a satellite fix [m].
        course_sigma: standard deviation of its course [rad].
        wheel_sigma: standard deviation of the wheel speed [m/s].
        acceleration_density: spectral density of the acceleration [m^2/s^3].
        turn_density: spectral density of the gyro's noise [rad^2/s].
    """
    sensors = [
        gf.sensor("gnss", position, outputs={"gnss_east": "m", "gnss_north": "m"}, R=position_sigma**2),
        gf.sensor("course", course, outputs={"course": "angle"}, R=course_sigma**2),
        gf.sensor("wheel", wheel, outputs={"wheel": "m/s"}, R=wheel_sigma**2),
    ]
    return gf.continuous_model(
        rate,
        states={"east": "m", "north": "m", "heading": "angle", "speed": "m/s"},
        inputs={"turn_rate": "rad/s"},
        Q=[1e-3, 1e-3, turn_density, acceleration_density],
        sensors=sensors,
        parameters={"mount": 0.0, "wheel_scale": 0.0, "gyro_scale": 0.0},
    )
