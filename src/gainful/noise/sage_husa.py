"""Measurement noise learned by forgetting averages of the innovations."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..models import AbstractModel
from ..updates import Update
from ..updates.noise_factors import Factors, check_limits, check_memory, multiplied, unexplained
from .base import AbstractNoise
from .nominal import Nominal


class Averages(eqx.Module):
    """What the law remembers.

    Attributes:
        factors: learned, on the variances of R.
        total: weight of all that is remembered, the model's own R counting as one measurement (m,).
        inner: memory of the inner law.
    """

    factors: Factors
    total: Float[Array, " m"]
    inner: Any


class SageHusa(AbstractNoise):
    """R by a forgetting average of what the innovations leave unexplained, component by component.

    ```
    s <- b s + w;  c <- c + (w / s) ((r^2 - [H P H^T]) / R - c),  floor <= c <= ceiling;  R <- sqrt(c) R sqrt(c)
    ```

    `w` is how far the update let the component count, so that a rejected outlier teaches nothing, nor does a missing
    reading. Where the average asks for more than the ceiling for `patience` measurements in a row, it is not the noise
    of the sensor that it sees but a prediction that is wrong: with Q set too small R runs away, the gain falls, and
    the prediction gets worse. The component then goes back to the model's R for good.

    Attributes:
        memory: `b`, weight of the past per measurement; 1 averages over all of it.
        floor: smallest factor on a variance of the model's R.
        ceiling: largest such factor.
        patience: measurements in a row above the ceiling before the component is given up.
        inner: the noise law that is adapted.

    Reads: the innovation, the weights. Writes: R.
    Source: Sage and Husa (1969), Joint Automatic Control Conference, 760-769.
    Differs: R alone, since R and Q together are not told apart by one average; bounds; learned for the next step; the
        correlations of R are the model's.
    Reduces to: `inner` for `floor = ceiling = 1`.

    Example:
        >>> import gainful as gf
        >>> gf.KalmanFilter(noise=SageHusa(memory=0.95)).noise.ceiling
        100.0
    """

    memory: float = 0.98
    floor: float = 1e-4
    ceiling: float = 100.0
    patience: int = eqx.field(static=True, default=20)
    inner: AbstractNoise = Nominal()

    def __check_init__(self) -> None:
        check_memory(self.memory)
        check_limits(self.floor, self.ceiling, self.patience)

    def init(self, model: AbstractModel) -> Averages:
        m = model.output.dof
        return Averages(Factors.start(m), jnp.ones(m), self.inner.init(model))

    def process(self, carry: Averages, Q: Float[Array, "dof dof"]) -> Float[Array, "dof dof"]:
        return self.inner.process(carry.inner, Q)

    def measurement(self, carry: Averages, R: Float[Array, "m m"]) -> Float[Array, "m m"]:
        return multiplied(self.inner.measurement(carry.inner, R), carry.factors.used)

    def learn(self, carry: Averages, update: Update) -> Averages:
        factors, weight = carry.factors, jnp.minimum(update.weight, 1.0)
        taught = weight > 0
        total = jnp.where(taught, self.memory * carry.total + weight, carry.total)
        raw = factors.value + weight / total * (unexplained(update, factors.used) - factors.value)
        moved = factors.moved(raw, taught, self.floor, self.ceiling, self.patience)
        return Averages(moved, total.astype(carry.total.dtype), self.inner.learn(carry.inner, update))
