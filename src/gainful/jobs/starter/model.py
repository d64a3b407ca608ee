"""A damped pendulum: functions of the state x, the inputs u, the time t and, by name, the parameters p."""

import jax.numpy as jnp

GRAVITY = 9.81  # m/s^2
MASS = 1.0  # kg
DAMPING = 0.1  # 1/s


def f(x, u, t, p):
    """Rates of angle [rad/s] and rate [rad/s^2]."""
    angle, rate = x
    torque = u[0] / (MASS * p["length"] ** 2)
    return jnp.array([rate, -GRAVITY / p["length"] * jnp.sin(angle) - DAMPING * rate + torque])


def h(x, u, t):
    """What the sensor reads without noise: the angle [rad]."""
    return x[:1]
