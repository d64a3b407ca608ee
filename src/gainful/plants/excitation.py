"""Input signals that make a plant show its parameters."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError


def prbs(
    steps: int,
    *,
    register: int = 9,
    taps: Sequence[int] = (9, 5),
    clock: int = 10,
    amplitude: float | Array = 1.0,
) -> Float[Array, " steps"]:
    """A pseudo-random binary sequence: `+amplitude` or `-amplitude`, from a shift register that starts with all ones.

    Every clock the last stage is the output, and the sum modulo 2 of the tapped stages enters the first one. With taps at
    the powers of a primitive polynomial, as by default `x^9 + x^5 + 1`, the sequence repeats after `2^register - 1`
    clocks and has one more high than low: nearly white up to a third of the clock's frequency.

    Args:
        steps: samples.
        register: stages of the shift register.
        taps: stages that are fed back, counted from 1; the last one must be among them.
        clock: samples per clock.
        amplitude: of the signal, in the input's unit.

    Raises:
        ConfigError: taps outside the register or without its last stage, or a clock of less than a sample.

    Source: Golomb (1967), Shift Register Sequences.

    Example:
        >>> prbs(12, register=3, taps=(3, 2), clock=1).tolist()
        [1.0, 1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, 1.0, -1.0, -1.0]
    """
    if register not in taps or not all(isinstance(tap, int) and 1 <= tap <= register for tap in taps):
        raise ConfigError(f"taps: expected stages from 1 to {register} with the last among them, got {list(taps)}")
    if not isinstance(clock, int) or clock < 1:
        raise ConfigError(f"clock: expected a whole number of samples of at least 1, got {clock!r}")
    stages, bits = [1] * register, []
    for _ in range(-(-steps // clock)):
        bits.append(stages[-1])
        stages = [sum(stages[tap - 1] for tap in taps) % 2, *stages[:-1]]
    return amplitude * jnp.asarray(np.repeat(2.0 * np.array(bits) - 1.0, clock)[:steps])


def multisine(
    t: Float[Array, " T"], frequencies: Sequence[float], amplitude: float | Array = 1.0
) -> Float[Array, " T"]:
    """Cosines of equal power with Schroeder's phases, which keep the peak low: their sum has the root mean square asked for.

    Args:
        t: times [s].
        frequencies: of the cosines [Hz].
        amplitude: root mean square of the sum over whole periods, in the input's unit.

    Raises:
        ConfigError: no frequency.

    Source: Schroeder (1970), IEEE Trans. Inf. Theory 16(1):85-89.
    """
    n = len(frequencies)
    if not n:
        raise ConfigError("frequencies: expected at least one, got none")
    phases = -math.pi * np.arange(n) * (np.arange(n) + 1) / n
    angles = 2.0 * math.pi * jnp.asarray(t)[:, None] * jnp.asarray(frequencies, float) + phases
    return amplitude * math.sqrt(2.0 / n) * jnp.cos(angles).sum(axis=1)


def chirp(
    t: Float[Array, " T"], first: float | Array, last: float | Array, amplitude: float | Array = 1.0
) -> Float[Array, " T"]:
    """A sine whose frequency runs linearly from the first [Hz] at `t[0]` to the last at `t[-1]`."""
    since = jnp.asarray(t) - t[0]
    turns = first * since + 0.5 * (last - first) * since**2 / since[-1]
    return amplitude * jnp.sin(2.0 * math.pi * turns)


def staircase(t: Float[Array, " T"], times: Sequence[float], levels: Sequence[float]) -> Float[Array, " T"]:
    """A staircase: 0 before the first of the times [s], then each level from its time on.

    Args:
        t: at which the signal is wanted [s].
        times: of the steps [s], rising.
        levels: from each time on, in the input's unit.

    Raises:
        ConfigError: times that do not rise, or not one level each.

    Example:
        >>> staircase(jnp.arange(5.0), [1.0, 3.0], [2.0, -1.0]).tolist()
        [0.0, 2.0, 2.0, -1.0, -1.0]
    """
    if len(times) != len(levels) or any(b <= a for a, b in itertools.pairwise(times)):
        raise ConfigError(f"times: expected one rising time per level, got {list(times)} for {list(levels)}")
    reached = jnp.searchsorted(jnp.asarray(times, float), jnp.asarray(t, float), side="right")
    return jnp.concatenate([jnp.zeros(1), jnp.asarray(levels, float)])[reached]
