"""A CMAC taught with a single record, judged on that record and on another, both drawn anew in every run."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ...aiding.playing import unaided
from ...filters import Info, kalman_filter
from ...networks import CMAC, Tiling, empty_cmac
from ...networks.cmac import credited
from ...networks.tiling import blocks_of
from ...plants import TRACK_SCENARIOS, TrackScenario, run_track
from ...updates import Corrected, UpdateFeatures
from ..experiment import Contender, Experiment, Quantity, Record
from .aiding import FINE
from .contenders import DESIGN
from .measures import STATES, UNITS
from .noise import design
from .records import STEADY, as_record, from_start

NAME = "one record"
SAME, NEW = "CMAC, on the record it was taught with", "CMAC, on a new record"
COLUMNS = (0, 1, 2)
"""Features that vary at a steady gain."""


class Two(eqx.Module):
    """Two records of one scenario, to be taught with and to be judged on."""

    lesson: Record
    fresh: Record


class DrawTwo(eqx.Module):
    """From a random key to both."""

    scenario: TrackScenario

    def __call__(self, key: Array) -> Two:
        one, other = (as_record(run_track(self.scenario, key=own)) for own in jax.random.split(key))
        return Two(one, other)


class TaughtWithOne(eqx.Module):
    """A contender: a CMAC taught with the lesson.

    Attributes:
        watched: the design filter, with features that a network would be told.
        on_lesson: 1 to be judged on the lesson, 0 on the other record.
        corrected: 1 with the network's correction, 0 without.
    """

    watched: Contender
    on_lesson: Array
    corrected: Array

    def __call__(self, both: Two) -> Array:
        features, wanted = self._seen(both.lesson)
        network = _taught(features, wanted)
        chosen = jax.tree.map(lambda one, other: jnp.where(self.on_lesson > 0, one, other), both.lesson, both.fresh)
        features, wanted = self._seen(chosen)
        return wanted - self.corrected * jax.vmap(network)(features)

    def _seen(self, record: Record) -> tuple[Array, Array]:
        info: Info = self.watched(record)
        return info.memory[0].features, record.truth["states"] - info.estimate.mean


def _taught(features: Array, wanted: Array) -> CMAC:
    chosen = features[:, jnp.array(COLUMNS)]
    levels, layers = FINE.levels, FINE.layers
    tiling = Tiling(
        chosen.min(axis=0),
        chosen.max(axis=0),
        jnp.zeros(len(COLUMNS)),
        jnp.ones(len(COLUMNS)),
        COLUMNS,
        levels,
        layers,
        (1,) * len(COLUMNS),
        "none",
        False,
        layers * blocks_of(levels, layers) ** len(COLUMNS),
    )
    network = empty_cmac((tiling,), features.shape[1], wanted.shape[1])
    cells = jax.vmap(network.addresses)(features)

    def one(tables: tuple[Array, Array], row: tuple[Array, Array]) -> tuple[tuple[Array, Array], None]:
        return credited(*tables, *row, FINE.rate, FINE.exponent, False), None

    tables, _ = jax.lax.scan(one, (network.weights, network.counts), (cells, wanted))
    return eqx.tree_at(lambda each: (each.weights, each.counts), network, tables)


class Measure(eqx.Module):
    """Mean square errors over the second half."""

    def __call__(self, both: Two, errors: Array) -> dict[str, Array]:
        return dict(zip(STATES, jnp.mean(errors[STEADY:] ** 2, axis=0), strict=True))


def same_record_experiment() -> Experiment:
    """The experiment: every run draws both records."""
    believed = design()
    plain: Corrected = unaided(kalman_filter(), UpdateFeatures(), believed.model)
    watched = Contender(kalman_filter(update=plain), believed.model, from_start(believed.cov))

    def contender(lesson: float, corrected: float) -> TaughtWithOne:
        return TaughtWithOne(watched, jnp.asarray(lesson), jnp.asarray(corrected))

    return Experiment(
        NAME,
        "A CMAC taught with a single record",
        DrawTwo(TRACK_SCENARIOS["calibrated"]),
        {
            f"{DESIGN}, on the record taught with": contender(1.0, 0.0),
            SAME: contender(1.0, 1.0),
            f"{DESIGN}, on a new record": contender(0.0, 0.0),
            NEW: contender(0.0, 1.0),
        },
        Measure(),
        tuple(Quantity(name, f"{name}, MSE", unit) for name, unit in UNITS.items()),
    )
