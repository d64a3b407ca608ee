"""What may happen to a body on a track that its filter does not know: eight scenarios as data, and their records."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..models import Instant, Sample
from .track import FIX_SIGMA, POSITION_SIGMA, SPEED_SIGMA, STEP, settled_track_covariance, track_transition

ROWS = 300
BEGIN = (0.0, 5.0)  # m, m/s
BLOCK = 50
"""Rows after which noise that varies is drawn anew."""
LEG, FIRST_LEG, GAP = 10, (5, 20), (20, 60)
"""Rows an acceleration lasts, the row of the first, and rows from the end of one to the next, drawn from such ranges."""


def _numbers(*values: Any) -> Any:
    return eqx.field(
        converter=lambda given: jnp.asarray(given, float), default=values[0] if len(values) == 1 else values
    )


class TrackScenario(eqx.Module):
    """What truly happens on the track; all scenarios differ in numbers only, so that they share compiled programs.

    Attributes:
        position_sigma: noise in displacement per step of 10 s [m].
        speed_sigma: noise in speed per step [m/s].
        fix_sigma: noise of a fix [m].
        speed_factors: range of a factor on `speed_sigma`, log-uniform, drawn anew every 50 steps.
        fix_factors: likewise on `fix_sigma`.
        acceleration: range of the sizes of accelerations, of random sign, that last 10 steps each [m/s^2].
        outlier_share: share of fixes with an extra error.
        outlier_sigma: of that error [m].
        correlation: of the noise of one fix with that of the next.
        bias: of all fixes [m].
        amplitudes: of an error of the fixes that repeats along the track [m].
        wavelengths: of its two waves [m].
        phases: of these [rad].
        start: size of the errors of the filter's start, of random signs [m, m/s].
        start_cov: covariance of a Gaussian error added to it.
    """

    position_sigma: Float[Array, ""] = _numbers(1.4)
    speed_sigma: Float[Array, ""] = _numbers(0.046)
    fix_sigma: Float[Array, ""] = _numbers(0.08)
    speed_factors: Float[Array, "2"] = _numbers(1.0, 1.0)
    fix_factors: Float[Array, "2"] = _numbers(1.0, 1.0)
    acceleration: Float[Array, "2"] = _numbers(0.0, 0.0)
    outlier_share: Float[Array, ""] = _numbers(0.0)
    outlier_sigma: Float[Array, ""] = _numbers(20.0)
    correlation: Float[Array, ""] = _numbers(0.0)
    bias: Float[Array, ""] = _numbers(0.0)
    amplitudes: Float[Array, "2"] = _numbers(0.0, 0.0)
    wavelengths: Float[Array, "2"] = _numbers(4000.0, 1500.0)
    phases: Float[Array, "2"] = _numbers(0.0, 1.0)
    start: Float[Array, "2"] = _numbers(5.0, 5.0)
    start_cov: Float[Array, "2 2"] = _numbers((0.0, 0.0), (0.0, 0.0))

    def fix_error(self, displacement: Float[Array, "..."]) -> Float[Array, "..."]:
        """The error of a fix that repeats at a place [m]."""
        phase = 2.0 * jnp.pi * displacement[..., None] / self.wavelengths + self.phases
        return jnp.sum(self.amplitudes * jnp.sin(phase), axis=-1)


class TrackRecord(eqx.Module):
    """What happened on a track, one row per fix, the first one 10 s after the start.

    Attributes:
        t: times [s] (T,).
        y: fixes [m] (T, 1).
        states: true displacement [m] and speed [m/s] (T, 2).
        start: where the filter believes the body to be at time 0 (2,).
    """

    t: Float[Array, " T"]
    y: Float[Array, "T 1"]
    states: Float[Array, "T 2"]
    start: Float[Array, "2"]

    @property
    def samples(self) -> Sample:
        """Stacked along time, for `track`."""
        when = Instant(self.t, jnp.full_like(self.t, STEP), jnp.zeros((len(self.t), 0)))
        return Sample(when, self.y, jnp.ones(self.y.shape, bool))


def run_track(scenario: TrackScenario, *, key: Array, rows: int = ROWS) -> TrackRecord:
    """A record of a scenario; the same key draws the same random numbers whatever the scenario.

    Pure: `jax.vmap(lambda key: run_track(scenario, key=key))(keys)` draws many records.

    Args:
        scenario: what happens.
        key: random key.
        rows: how many fixes.

    Raises:
        ConfigError: no rows.

    Example:
        >>> run_track(TRACK_SCENARIOS["manoeuvre"], key=jax.random.key(0)).states.shape
        (300, 2)
    """
    if rows < 1:
        raise ConfigError(f"rows: expected at least 1, got {rows!r}")
    keys = jax.random.split(key, 7)
    blocks = np.arange(rows) // BLOCK

    def factors(own: Array, bounds: Array) -> Array:
        low, high = jnp.log(bounds)
        return jnp.exp(low + (high - low) * jax.random.uniform(own, (blocks[-1] + 1,), float))[blocks]

    position, speed, fix, first = jax.random.normal(keys[0], (4, rows), float)
    push = jnp.stack([scenario.position_sigma * position, scenario.speed_sigma * speed], axis=1)
    push = push * jnp.stack([jnp.ones(rows), factors(keys[1], scenario.speed_factors)], axis=1)
    legs = _accelerations(scenario, keys[2], rows)
    push = push + legs[:, None] * jnp.array([STEP**2 / 2, STEP])
    transition = track_transition(STEP)

    def move(x: Array, pushed: Array) -> tuple[Array, Array]:
        x = transition @ x + pushed
        return x, x

    begin = jnp.asarray(BEGIN)
    states = jax.lax.scan(move, begin, push)[1]
    sigma = scenario.fix_sigma * factors(keys[3], scenario.fix_factors)
    noise = sigma * correlated(fix, scenario.correlation)
    strikes, sizes = jax.random.uniform(keys[4], (rows,), float), jax.random.normal(keys[5], (rows,), float)
    noise = noise + jnp.where(strikes < scenario.outlier_share, scenario.outlier_sigma * sizes, 0.0)
    y = states[:, 0] + noise + scenario.bias + scenario.fix_error(states[:, 0])
    signs = jax.random.rademacher(keys[6], (2,), float)
    off = signs * scenario.start + _root(scenario.start_cov) @ first[:2]
    return TrackRecord(STEP * jnp.arange(1.0, rows + 1.0), y[:, None], states, begin - off)


def correlated(white: Float[Array, " T"], correlation: Float[Array, ""]) -> Float[Array, " T"]:
    """Noise of unit variance whose neighbours are correlated, from white noise of unit variance."""

    def step(last: Array, new: Array) -> tuple[Array, Array]:
        value = correlation * last + jnp.sqrt(1.0 - correlation**2) * new
        return value, value

    rest = jax.lax.scan(step, white[0], white[1:])[1]
    return jnp.concatenate([white[:1], rest])


def _accelerations(scenario: TrackScenario, key: Array, rows: int) -> Float[Array, " rows"]:
    """The acceleration in each step [m/s^2]."""
    begins, gaps, sizes, signs = jax.random.split(key, 4)
    count = rows // LEG + 1
    first = jax.random.randint(begins, (), *FIRST_LEG)
    apart = LEG + jax.random.randint(gaps, (count,), *GAP)
    starts = first + jnp.cumsum(apart) - apart
    low, high = scenario.acceleration
    size = (low + (high - low) * jax.random.uniform(sizes, (count,), float)) * jax.random.rademacher(
        signs, (count,), float
    )
    since = jnp.arange(rows)[:, None] - starts
    return jnp.sum(jnp.where((since >= 0) & (since < LEG), size, 0.0), axis=1)


def _root(cov: Float[Array, "2 2"]) -> Float[Array, "2 2"]:
    """The Cholesky root of a covariance that may be zero."""
    a = jnp.sqrt(cov[0, 0])
    b = cov[1, 0] / jnp.where(a > 0, a, 1.0)
    return jnp.stack([jnp.stack([a, 0.0 * a]), jnp.stack([b, jnp.sqrt(jnp.maximum(cov[1, 1] - b**2, 0.0))])])


def _scenario(**numbers: Any) -> TrackScenario:
    """The calibrated scenario with some numbers of its own."""
    return TrackScenario(**numbers)


TRACK_SCENARIOS: dict[str, TrackScenario] = {
    "matched": _scenario(
        position_sigma=POSITION_SIGMA,
        speed_sigma=SPEED_SIGMA,
        fix_sigma=FIX_SIGMA,
        start=(0.0, 0.0),
        start_cov=settled_track_covariance(),
    ),
    "calibrated": _scenario(),
    "timevarying": _scenario(position_sigma=0.5, speed_factors=(0.25, 2.0), fix_factors=(1.0, 50.0)),
    "manoeuvre": _scenario(speed_sigma=0.005, acceleration=(0.005, 0.02)),
    "outliers": _scenario(outlier_share=0.05),
    "coloured": _scenario(fix_sigma=2.0, correlation=0.9),
    "bias": _scenario(bias=0.5),
    "map": _scenario(amplitudes=(1.5, 1.0)),
}
"""Scenarios by name: in `matched` all is as the designer of `track` assumes, in `calibrated` the noise is not; the others
change one thing each."""
