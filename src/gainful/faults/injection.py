"""Faults put into signals on purpose."""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError


class AbstractInjection(eqx.Module):
    """A fault of one signal between two times: `faulty = value + change` while it is active, `value` else.

    Pure functions of value, time and key, so they may be called inside a simulation and `vmap` over sizes, times and
    keys applies.

    Attributes:
        signal: name of the input or output.
        onset: first time at which the signal is faulty [s].
        end: first time at which it is sound again [s].
    """

    signal: eqx.AbstractVar[str]
    onset: eqx.AbstractVar[Array | float]
    end: eqx.AbstractVar[Array | float]

    @property
    def word(self) -> str:
        """What a record's counts call it."""
        return type(self).__name__.lower()

    @property
    def random(self) -> bool:
        """Whether the change is noise, which no fault state stands for."""
        return False

    @abc.abstractmethod
    def change(self, value: Float[Array, ""], t: Float[Array, ""], key: Array) -> Float[Array, ""]:
        """What the active fault adds to the sound value at a time [s]; affine in the value."""

    def active(self, t: Float[Array, ""]) -> Bool[Array, ""]:
        """Whether the signal is faulty at a time [s]."""
        return (t >= self.onset) & (t < self.end)

    def faulty(self, value: Float[Array, ""], t: Float[Array, ""], key: Array) -> Float[Array, ""]:
        """What the active fault makes of the value at a time [s]."""
        return value + self.change(value, t, key)

    def __call__(self, value: Float[Array, ""], t: Float[Array, ""], key: Array) -> Float[Array, ""]:
        """The signal with its fault at a time [s]; the value itself, to the last bit, while sound."""
        return jnp.where(self.active(t), self.faulty(value, t, key), value)


class Bias(AbstractInjection):
    """A constant added.

    Attributes:
        size: in the signal's unit.

    Example:
        >>> fault = Bias("gyro", 0.1, onset=50.0, end=150.0)
        >>> [float(fault(1.0, t, None)) for t in (49.9, 50.0, 150.0)]
        [1.0, 1.1, 1.0]
    """

    signal: str = eqx.field(static=True)
    size: Array | float
    onset: Array | float = 0.0
    end: Array | float = float("inf")

    def change(self, value: Array, t: Array, key: Array) -> Array:
        return jnp.asarray(self.size)


class Drift(AbstractInjection):
    """A ramp added: `rate (t - onset)`.

    Attributes:
        rate: in the signal's unit per second.
    """

    signal: str = eqx.field(static=True)
    rate: Array | float
    onset: Array | float = 0.0
    end: Array | float = float("inf")

    def change(self, value: Array, t: Array, key: Array) -> Array:
        return self.rate * (jnp.asarray(t) - self.onset)


class Stuck(AbstractInjection):
    """One value whatever the signal does.

    Attributes:
        level: the value, in the signal's unit.
    """

    signal: str = eqx.field(static=True)
    level: Array | float
    onset: Array | float = 0.0
    end: Array | float = float("inf")

    def change(self, value: Array, t: Array, key: Array) -> Array:
        return self.level - value

    def faulty(self, value: Array, t: Array, key: Array) -> Array:
        return jnp.asarray(self.level)  # not value + (level - value), which rounds


class Loss(AbstractInjection):
    """A share lost: `(1 - share) value`; a negative share is a gain.

    Attributes:
        share: 0 for a sound signal, 1 for a dead one.
    """

    signal: str = eqx.field(static=True)
    share: Array | float
    onset: Array | float = 0.0
    end: Array | float = float("inf")

    def change(self, value: Array, t: Array, key: Array) -> Array:
        return -self.share * jnp.asarray(value)


class NoiseIncrease(AbstractInjection):
    """White noise added, independent at every call with another key.

    Attributes:
        sigma: of the noise added, in the signal's unit; variances add up.
    """

    signal: str = eqx.field(static=True)
    sigma: Array | float
    onset: Array | float = 0.0
    end: Array | float = float("inf")

    @property
    def word(self) -> str:
        return "noise"

    @property
    def random(self) -> bool:
        return True

    def change(self, value: Array, t: Array, key: Array) -> Array:
        return self.sigma * jax.random.normal(key, jnp.shape(value))


class Outliers(AbstractInjection):
    """Gross errors: with probability `share`, independent at every call with another key, white noise is added.

    Attributes:
        share: of values that are outliers, from 0 to 1.
        sigma: of what is added to them, in the signal's unit.

    Example:
        >>> fault = Outliers("range", share=0.1, sigma=20.0)
        >>> keys = jax.random.split(jax.random.key(0), 1000)
        >>> int(sum(fault(5.0, 0.0, key) != 5.0 for key in keys))
        99
    """

    signal: str = eqx.field(static=True)
    share: Array | float
    sigma: Array | float
    onset: Array | float = 0.0
    end: Array | float = float("inf")

    def __check_init__(self) -> None:
        if isinstance(self.share, (int, float)) and not 0 <= self.share <= 1:
            raise ConfigError(f"share: expected a number from 0 to 1, got {self.share!r}")

    @property
    def random(self) -> bool:
        return True

    def change(self, value: Array, t: Array, key: Array) -> Array:
        whether, how = jax.random.split(key)
        gross = jax.random.bernoulli(whether, self.share, jnp.shape(value))
        return jnp.where(gross, self.sigma * jax.random.normal(how, jnp.shape(value)), 0.0)


class Intermittent(AbstractInjection):
    """Another fault that comes and goes: active for the first `duty` of every `period` from its onset on.

    Attributes:
        fault: what comes and goes, with its signal, onset and end.
        period: from one coming to the next [s].
        duty: share of the period during which it is there.

    Example:
        >>> fault = Intermittent(Bias("gyro", 0.1, onset=10.0), period=4.0, duty=0.25)
        >>> [bool(fault.active(t)) for t in (9.0, 10.0, 10.9, 11.0, 14.5)]
        [False, True, True, False, True]
    """

    fault: AbstractInjection
    period: Array | float
    duty: Array | float = 0.5

    @property
    def signal(self) -> str:
        """The signal of the fault that comes and goes."""
        return self.fault.signal

    @property
    def onset(self) -> Array | float:
        """Its first coming [s]."""
        return self.fault.onset

    @property
    def end(self) -> Array | float:
        """When it is gone for good [s]."""
        return self.fault.end

    @property
    def word(self) -> str:
        return f"intermittent {self.fault.word}"

    @property
    def random(self) -> bool:
        return self.fault.random

    def active(self, t: Float[Array, ""]) -> Bool[Array, ""]:
        phase = jnp.mod(jnp.asarray(t) - self.onset, self.period)
        return self.fault.active(t) & (phase < self.duty * self.period)

    def change(self, value: Array, t: Array, key: Array) -> Array:
        return self.fault.change(value, t, key)

    def faulty(self, value: Array, t: Array, key: Array) -> Array:
        return self.fault.faulty(value, t, key)
