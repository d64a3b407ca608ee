"""Vectors of named signals, some of them faulty."""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, did_you_mean
from .injection import AbstractInjection


def disturb(
    values: Float[Array, " n"],
    names: Sequence[str],
    faults: Sequence[AbstractInjection],
    t: Float[Array, ""],
    key: Array,
) -> Float[Array, " n"]:
    """A vector of named signals with the faults that concern it; to be called inside a simulation.

    Faults of other signals are passed over, so that one list serves inputs and outputs; `check_signals` finds names
    that belong to neither. Faults of one signal add up, each acting on the sound value.

    Args:
        values: the sound signals.
        names: one each.
        faults: what goes wrong.
        t: time [s].
        key: random key of this moment.
    """
    names = tuple(names)
    parts = list(values)
    for fault, own in zip(faults, jax.random.split(key, max(len(faults), 1)), strict=False):
        if fault.signal in names:
            row = names.index(fault.signal)
            others = parts[row] - values[row]
            parts[row] = jnp.where(fault.active(t), fault.faulty(values[row], t, own) + others, parts[row])
    return jnp.stack(parts) if parts else values


def check_signals(faults: Sequence[AbstractInjection], known: Sequence[str]) -> None:
    """Raise unless every fault is one, of a signal that is known.

    Raises:
        ConfigError: a fault of something else.
    """
    for fault in faults:
        if not isinstance(fault, AbstractInjection):
            raise ConfigError(f"faults: expected Bias, Drift, Stuck, Loss, ..., got {type(fault).__name__}")
        if fault.signal not in known:
            raise ConfigError(f"faults: {fault.signal!r} is not a signal; {did_you_mean(fault.signal, known)}")


class FaultySignals(eqx.Module):
    """What makes faulty signals of sound ones at a time: the form in which a closed loop takes its faults.

    Attributes:
        names: of the signals, in the order of their vector.
        faults: what goes wrong; those of other signals are passed over.
        key: random key, for noise; another one is drawn from it for every time.

    Example:
        >>> import jax
        >>> from gainful.faults import Loss
        >>> wheels = FaultySignals(("wheel_x", "wheel_y"), (Loss("wheel_x", 0.5, onset=50.0),))
        >>> wheels(jnp.array([0.02, 0.02]), jnp.asarray(60.0)).tolist()
        [0.01, 0.02]
    """

    names: tuple[str, ...] = eqx.field(static=True)
    faults: tuple[AbstractInjection, ...]
    key: Array = eqx.field(default_factory=lambda: jax.random.key(0))

    def __call__(self, values: Float[Array, " n"], t: Float[Array, ""]) -> Float[Array, " n"]:
        bits = jax.lax.bitcast_convert_type(jnp.asarray(t, jnp.float32), jnp.uint32)
        return disturb(values, self.names, self.faults, t, jax.random.fold_in(self.key, bits))
