"""How parameters change over a record: the faults of signals, applied to parameters, and a bounded random walk."""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from .injection import AbstractInjection, Bias, Drift
from .signals import check_signals, disturb


def parameter_tracks(
    t: Float[Array, " T"],
    nominal: dict[str, float],
    faults: Sequence[AbstractInjection] = (),
    *,
    key: Array | None = None,
) -> Float[Array, "T parameters"]:
    """Parameters at given times, some of them faulty: a jump is a `Bias`, a loss of half a `Loss`, and so on.

    Args:
        t: times [s]. For parameters held over intervals, those of the intervals' middles put a jump at an interval's
            end into the next interval, free of rounding.
        nominal: sound values by name.
        faults: what goes wrong with which parameter, and when.
        key: random key, for faults that are noise.

    Raises:
        ConfigError: a fault of something else.

    Example:
        >>> faults = [Bias("p1", 1.0, onset=2.0), Bias("p2", -0.4, onset=3.0)]
        >>> parameter_tracks(jnp.arange(4.0) + 0.5, {"p1": 1.0, "p2": 1.0}, faults)[:, 0].tolist()
        [1.0, 1.0, 2.0, 2.0]
    """
    names = tuple(nominal)
    check_signals(faults, names)
    values = jnp.asarray(list(nominal.values()), float)
    keys = jax.random.split(jax.random.key(0) if key is None else key, jnp.shape(t)[0])
    return jax.vmap(lambda t, key: disturb(values, names, faults, t, key))(jnp.asarray(t, float), keys)


def ramp(signal: str, size: float | Array, start: float | Array, end: float | Array) -> tuple[Drift, Bias]:
    """A change that grows from the start to the end [s] and then stays: a drift that a bias takes over from.

    Args:
        signal: name of the signal or parameter.
        size: of the change, in its unit.
        start: of the growth [s].
        end: of the growth [s].

    Example:
        >>> t = jnp.array([0.0, 1.0, 2.0, 9.0])
        >>> parameter_tracks(t, {"p1": 1.0}, ramp("p1", 0.5, 1.0, 3.0))[:, 0].tolist()
        [1.0, 1.0, 1.25, 1.5]
    """
    growing = Drift(signal=signal, rate=size / (end - start), onset=start, end=end)
    return growing, Bias(signal=signal, size=size, onset=end)


def reflected_walk(
    key: Array,
    steps: int,
    sigma: float | Array,
    *,
    start: float | Array = 1.0,
    lower: float = 0.4,
    upper: float = 2.0,
) -> Float[Array, " steps"]:
    """A random walk reflected at two bounds, one step after the start at the first sample.

    A free walk folded into the bounds has the law of one that is reflected at every step, since the steps are symmetric.

    Args:
        key: random key.
        steps: samples.
        sigma: standard deviation of a step.
        start: value before the first sample.
        lower: bound.
        upper: bound.

    Raises:
        ConfigError: bounds in the wrong order.
    """
    if not lower < upper:
        raise ConfigError(f"bounds: expected lower < upper, got {lower} and {upper}")
    width = upper - lower
    free = start - lower + jnp.cumsum(sigma * jax.random.normal(key, (steps,)))
    return lower + width - jnp.abs(jnp.mod(free, 2.0 * width) - width)
