"""Measurement noise matched to the innovations of a window."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..errors import ConfigError
from ..models import AbstractModel
from ..updates import Update
from ..updates.noise_factors import Factors, check_limits, multiplied, unexplained
from .base import AbstractNoise
from .nominal import Nominal


class Window(eqx.Module):
    """What the law remembers.

    Attributes:
        factors: learned, on the variances of R.
        samples: what the last innovations of each component left unexplained, newest last (window, m).
        count: how many innovations of each component there have been (m,).
        inner: memory of the inner law.
    """

    factors: Factors
    samples: Float[Array, "window m"]
    count: Int[Array, " m"]
    inner: Any


class InnovationMatching(AbstractNoise):
    """R such that the innovations of a window are as large as predicted, component by component.

    ```
    c = mean over the window of (r^2 - [H P H^T]) / R,  floor <= c <= ceiling;  R <- sqrt(c) R sqrt(c)
    ```

    It follows a change within the window, at the price of noise: the factor's own standard deviation is
    `sqrt(2 / window) S / R`, large where the innovations are mostly motion (`R` small beside `S`). What the update did
    not let count teaches nothing, nor does a missing reading. Components whose window asks for more than the ceiling for
    `patience` measurements in a row go back to the model's R for good, see `SageHusa`.

    Attributes:
        window: innovations averaged.
        settle: innovations of the start's transient left out.
        floor: smallest factor on a variance of the model's R.
        ceiling: largest such factor.
        patience: measurements in a row above the ceiling before the component is given up.
        inner: the noise law that is adapted.

    Reads: the innovation, the weights. Writes: R.
    Source: Mehra (1970), IEEE Trans. Autom. Control 15(2):175-184; Mohamed and Schwarz (1999), J. Geodesy 73:193-203.
    Differs: R alone; each innovation less its own prediction, so that steps may vary; bounds; learned for the next
        step; the correlations of R are the model's.
    Reduces to: `inner` for a window longer than the record.

    Example:
        >>> import gainful as gf
        >>> gf.KalmanFilter(noise=InnovationMatching(window=30)).noise.settle
        3
    """

    window: int = eqx.field(static=True, default=20)
    settle: int = eqx.field(static=True, default=3)
    floor: float = 1e-4
    ceiling: float = 100.0
    patience: int = eqx.field(static=True, default=20)
    inner: AbstractNoise = Nominal()

    def __check_init__(self) -> None:
        for name, least in (("window", 1), ("settle", 0)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise ConfigError(f"{name}: expected a whole number of at least {least}, got {value!r}")
        check_limits(self.floor, self.ceiling, self.patience)

    def init(self, model: AbstractModel) -> Window:
        m = model.output.dof
        none = jnp.zeros((self.window, m))
        return Window(Factors.start(m), none, jnp.zeros(m, jnp.int32), self.inner.init(model))

    def process(self, carry: Window, Q: Float[Array, "dof dof"]) -> Float[Array, "dof dof"]:
        return self.inner.process(carry.inner, Q)

    def measurement(self, carry: Window, R: Float[Array, "m m"]) -> Float[Array, "m m"]:
        return multiplied(self.inner.measurement(carry.inner, R), carry.factors.used)

    def learn(self, carry: Window, update: Update) -> Window:
        factors, weight = carry.factors, jnp.minimum(update.weight, 1.0)
        taught = weight > 0
        # What counted in part is completed by what the factor expects.
        sample = weight * unexplained(update, factors.used) + (1.0 - weight) * factors.value
        newest = jnp.concatenate([carry.samples[1:], sample[None].astype(carry.samples.dtype)])
        samples = jnp.where(taught, newest, carry.samples)
        count = jnp.where(taught, carry.count + 1, carry.count).astype(carry.count.dtype)
        full = taught & (count >= self.window + self.settle)
        moved = factors.moved(jnp.mean(samples, axis=0), full, self.floor, self.ceiling, self.patience)
        return Window(moved, samples, count, self.inner.learn(carry.inner, update))
