"""A hydraulic rotary actuator driven by the pressures at its ports, in the logger's counts and samples."""

import jax.numpy as jnp

import gainful as gf


def rate(x, u, t, p):
    """The pressure difference turns the shaft against a load and friction; see `model` for the units."""
    inlet, outlet = u
    return jnp.array([x[1], p["gain"] * (inlet - outlet - p["load"] - p["friction"] * x[1])])


def angle(x, u, t):
    """The shaft's angle, counted in the direction of the stroke [counts]."""
    return x[:1]


def outlet(x, u, t, p):
    """Outlet pressure [counts]: what the shaft pushes out and what leaks past its seal leave through one orifice."""
    return (((x[1] + p["leakage"] * (u[0] - u[1])) / p["opening"]) ** 2)[None]


def model(angle_sigma=4.0, outlet_sigma=60.0, speed_density=0.1, **start):
    """Angle and speed of the shaft. Time is counted in samples, angle and pressures in the logger's counts.

    Args:
        angle_sigma: standard deviation of the angle's readings [counts].
        outlet_sigma: how far the orifice's law is off [pressure counts].
        speed_density: spectral density of what else accelerates the shaft [counts^2 / sample^3].
        start: parameters in place of those below.
    """
    parameters = {
        "gain": 1e-3,  # angle counts / sample^2 per pressure count
        "load": 300.0,  # pressure counts; Coulomb friction is in it: one stroke has one direction
        "friction": 0.0,  # pressure counts per (angle count / sample)
        "leakage": 0.0,  # angle counts / sample per pressure count
        "opening": 0.19,  # angle counts / sample per square root of a pressure count
    }
    return gf.continuous_model(
        rate,
        states={"angle": "1", "speed": "1"},
        inputs={"inlet": "1", "back": "1"},
        Q=[speed_density],
        G=[[0.0], [1.0]],
        sensors=[
            gf.sensor("shaft", angle, outputs={"shaft": "1"}, R=angle_sigma**2),
            gf.sensor("outlet", outlet, outputs={"outlet": "1"}, R=outlet_sigma**2),
        ],
        parameters=parameters | start,
    )
