"""What the vehicle does in the paper's experiments, and what two sensors make of it."""

from __future__ import annotations

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...models import Instant, Sample
from ...plants import fourier_excitation
from ..experiment import Record

COSINES = (-0.01, 0.12, -0.21, 0.18, 0.65)  # rad/s or m/s
SINES = (-0.07, 0.53, -0.13, -0.37, -0.06)  # rad/s or m/s
PERIOD, STEP = 20.0, 0.05  # s
SAMPLES = 2000
PARAMETERS = ("m", "d", "d2")
WORDS = {"m": "inertia with added mass, m", "d": "linear drag, d", "d2": "quadratic drag, d2"}
"""The parameters in words."""


@dataclasses.dataclass(frozen=True)
class Axis:
    """One degree of freedom of a vehicle.

    Attributes:
        name: of the motion.
        theta: inertia with added mass, linear and quadratic drag.
        units: of them.
    """

    name: str
    theta: tuple[float, float, float]
    units: tuple[str, str, str]

    @property
    def unit_of(self) -> dict[str, str]:
        """Units by parameter."""
        return dict(zip(PARAMETERS, self.units, strict=True))


ROTATION, TRANSLATION = ("kg m^2", "N m s", "N m s^2"), ("kg", "N s/m", "N s^2/m^2")
YAW = Axis("yaw", (80.0, 50.0, 100.0), ROTATION)
SURGE = Axis("surge", (215.0, 70.0, 100.0), TRANSLATION)


@functools.cache
def motion(samples: int, period: float = PERIOD, amplitude: float = 1.0) -> Float[Array, "T 3"]:
    """Acceleration, rate and its square with sign, without noise.

    Args:
        samples: how many, `STEP` apart.
        period: of the excitation [s].
        amplitude: over that of the paper-like experiments.
    """
    a, b = (amplitude * jnp.asarray(each) for each in (COSINES, SINES))
    _, rate, acceleration = fourier_excitation(a, b, period, STEP * jnp.arange(samples))
    return jnp.stack([acceleration, rate, rate * jnp.abs(rate)], axis=1)


class NoisyRows(eqx.Module):
    """From a random key to rows `[h, z]` of two sensors, with independent noise of equal size in every column.

    A key draws the same random numbers whatever else is different.

    Attributes:
        regressors: without noise (T, 3).
        theta: the parameters, sample by sample (T, 3).
        std: standard deviation of each sensor's noise, in the unit of whatever column.
    """

    regressors: Float[Array, "T 3"]
    theta: Float[Array, "T 3"]
    std: Float[Array, "2"]

    def __call__(self, key: Array) -> Record:
        clean = jnp.concatenate([self.regressors, jnp.sum(self.regressors * self.theta, axis=1)[:, None]], axis=1)
        noise = jax.random.normal(key, (len(clean), 2, 4))
        rows = clean[:, None] + self.std[:, None] * noise
        t = STEP * jnp.arange(1.0, len(rows) + 1.0)
        when = Instant(t, jnp.full_like(t, STEP), rows[..., :3].reshape(len(rows), -1))
        return Record(Sample(when, rows[..., 3], jnp.ones(rows.shape[:2], bool)), {"theta": self.theta})


def rows_of(record: Record) -> Float[Array, "T 2 4"]:
    """The rows of a record."""
    samples = record.samples
    regressors = samples.when.u.reshape(*samples.y.shape, len(PARAMETERS))
    return jnp.concatenate([regressors, samples.y[..., None]], axis=-1)


def noisy_rows(axis: Axis, variances: tuple[float, float], samples: int = SAMPLES) -> NoisyRows:
    """Records of an axis with constant parameters.

    Args:
        axis: of the vehicle.
        variances: of the two sensors' noise, in every column.
        samples: how many.
    """
    theta = jnp.tile(jnp.asarray(axis.theta), (samples, 1))
    return NoisyRows(motion(samples), theta, jnp.sqrt(jnp.asarray(variances)))
