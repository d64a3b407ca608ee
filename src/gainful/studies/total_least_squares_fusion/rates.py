"""A realistic vehicle: everything but the wrench comes from rate sensors, and so does the noise of the regressors."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .records import ROTATION, TRANSLATION, Axis, motion

SAMPLES, PERIOD, AMPLITUDE = 4000, 8.0, 0.5
"""200 s; period of the excitation in s, and its amplitude over that of the paper-like experiments."""
YAW = Axis("yaw", (0.16 + 0.12, 0.07, 1.55), ROTATION)
SURGE = Axis("surge", (11.5 + 5.5, 4.03, 18.18), TRANSLATION)


class RateRecord(eqx.Module):
    """Two rate sensors and one wrench, with how noisy they are, which contenders may know.

    Attributes:
        rates: of the two sensors (2, T).
        wrench: force or moment (T,).
        rate_std: of either sensor.
        wrench_std: of the wrench.
        truth: the parameters, which only the judges see.
    """

    rates: Float[Array, "2 T"]
    wrench: Float[Array, "T"]
    rate_std: Float[Array, ""]
    wrench_std: Float[Array, ""]
    truth: dict[str, Float[Array, "3"]]

    @property
    def mean_rate(self) -> Float[Array, "T"]:
        """Of the two sensors."""
        return jnp.mean(self.rates, axis=0)

    @property
    def mean_std(self) -> Float[Array, ""]:
        """Of the mean rate."""
        return self.rate_std / jnp.sqrt(2.0)


class Sailing(eqx.Module):
    """From a random key to a record; a key draws the same random numbers whatever else is different.

    Attributes:
        regressors: acceleration, rate and its square with sign (T, 3).
        theta: the parameters (3,).
        rate_std: standard deviation of either rate sensor's white noise.
        wrench_std: of that of the wrench.
    """

    regressors: Float[Array, "T 3"]
    theta: Float[Array, "3"]
    rate_std: Float[Array, ""]
    wrench_std: Float[Array, ""]

    def __call__(self, key: Array) -> RateRecord:
        sensing, pushing = jax.random.split(key)
        rate = self.regressors[:, 1]
        rates = rate + self.rate_std * jax.random.normal(sensing, (2, len(rate)))
        wrench = self.regressors @ self.theta + self.wrench_std * jax.random.normal(pushing, rate.shape)
        return RateRecord(rates, wrench, self.rate_std, self.wrench_std, {"theta": self.theta})


def sailing(axis: Axis, rate_std: float, wrench_std: float) -> Sailing:
    """Records of an axis.

    Args:
        axis: of the vehicle.
        rate_std: standard deviation of either rate sensor's white noise, in rad/s or m/s.
        wrench_std: of that of the wrench, in N m or N.
    """
    regressors = motion(SAMPLES, PERIOD, AMPLITUDE)
    return Sailing(regressors, *(jnp.asarray(each, float) for each in (axis.theta, rate_std, wrench_std)))
