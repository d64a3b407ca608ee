"""A robot mower that measures its way and its distance to radio beacons."""

from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import pandas as pd

import gainful as gf


class Range(eqx.Module):
    """Distance from the rover to a beacon [m]."""

    beacon: jnp.ndarray

    def __call__(self, x, u, t):
        return jnp.hypot(x[0] - self.beacon[0], x[1] - self.beacon[1])[None]


def rate(x, u, t):
    """The rover drives along its heading at the measured speed and turns at the measured rate."""
    speed, turn_rate = u
    return jnp.array([speed * jnp.cos(x[2]), speed * jnp.sin(x[2]), turn_rate])


def noise_input(x, u, t):
    """Noise of speed and turn rate enters where they do."""
    return jnp.array([[jnp.cos(x[2]), 0.0], [jnp.sin(x[2]), 0.0], [0.0, 1.0]])


def model(beacons="data/beacons.csv", range_sigma=0.5, speed_density=1e-2, turn_density=2e-5):
    """The rover with one range sensor per beacon.

    Args:
        beacons: surveyed positions, a CSV with `beacon_id, x_m, y_m`.
        range_sigma: standard deviation of a range's quick noise [m]; what changes slowly is the bias.
        speed_density: spectral density of the odometer's speed noise [m^2/s].
        turn_density: spectral density of the gyro's noise [rad^2/s].
    """
    table = pd.read_csv(Path(__file__).parent / beacons)
    ranges = [
        gf.sensor(name, Range(jnp.array([row.x_m, row.y_m])), outputs={name: "m"}, R=range_sigma**2)
        for row in table.itertuples()
        for name in [f"range_{row.beacon_id}"]
    ]
    return gf.continuous_model(
        rate,
        states={"x": "m", "y": "m", "heading": "angle"},
        inputs={"speed": "m/s", "turn_rate": "rad/s"},
        Q=[speed_density, turn_density],
        G=noise_input,
        sensors=ranges,
    )
