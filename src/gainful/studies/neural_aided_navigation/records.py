"""Records of the track: those the contenders are judged on, and others to train and to validate with."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ...estimates import Gaussian
from ...plants import TRACK_SCENARIOS, TrackRecord, TrackScenario, run_track, track
from ...plants.track_scenarios import ROWS
from ...running import Log, make_log
from ...spaces import AbstractSpace
from ..experiment import Record
from ..prepared import once

SEED = 1
SCENARIOS = tuple(TRACK_SCENARIOS)
STEADY = ROWS // 2
"""The first row of the steady part."""
TRAINING, VALIDATION = 40, 30
"""Records of each scenario that networks learn from, and that gates are set by."""
_APART = 1_000_000
"""Runs have smaller numbers than the keys of training, which therefore draw other records."""
WIDE = ((100.0, 0.0), (0.0, 100.0))
"""Covariance of a start that is known to be poor [m^2, m^2/s^2]."""


class Drive(eqx.Module):
    """From a random key to a record of a scenario."""

    scenario: TrackScenario

    def __call__(self, key: Array) -> Record:
        return as_record(run_track(self.scenario, key=key))


def as_record(record: TrackRecord) -> Record:
    """What contenders may see, and what they may not."""
    return Record(record.samples, {"t": record.t, "states": record.states, "start": record.start})


class FromStart(eqx.Module):
    """From a record to the estimate before its first row: where it starts, with a covariance.

    Attributes:
        cov: of the start.
        space: of the model.
    """

    cov: Array
    space: AbstractSpace

    def __call__(self, record: Record) -> Gaussian:
        return Gaussian.start(record.truth["start"], self.cov, self.space)


@once
def space() -> AbstractSpace:
    """Of the track's state."""
    return track().space


def from_start(cov: object = WIDE) -> FromStart:
    """Starts with a covariance; a wide one by default."""
    return FromStart(jnp.asarray(cov, float), space())


def training_key(*path: int) -> Array:
    """A random key of training, unlike those of all runs.

    Args:
        path: what it is for.
    """
    key = jax.random.fold_in(jax.random.key(SEED), _APART)
    for each in path:
        key = jax.random.fold_in(key, each)
    return key


@once
def lessons(scenario: str) -> tuple[TrackRecord, tuple[Log, ...]]:
    """Records to train with, and behind them those to validate with: as they are, stacked, and as logs with their truth."""
    keys = jax.random.split(training_key(SCENARIOS.index(scenario)), TRAINING + VALIDATION)
    chosen = TRACK_SCENARIOS[scenario]
    drawn = jax.tree.map(np.asarray, _drawn(chosen, keys))
    logs = tuple(
        make_log(
            track(),
            drawn.t[k],
            drawn.y[k],
            truth={"displacement": drawn.states[k, :, 0], "speed": drawn.states[k, :, 1]},
            start=0.0,
        )
        for k in range(len(keys))
    )
    return drawn, logs


@eqx.filter_jit
def _drawn(scenario: TrackScenario, keys: Array) -> TrackRecord:
    return jax.lax.map(lambda key: run_track(scenario, key=key), keys)


def priors(scenario: str, cov: object = WIDE) -> list[Gaussian]:
    """The estimates before the first row of the same records."""
    starts = lessons(scenario)[0].start
    return [Gaussian.start(jnp.asarray(start), jnp.asarray(cov, float), space()) for start in starts]
