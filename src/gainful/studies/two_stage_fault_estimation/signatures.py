"""Which fault it is: nine signatures of three wheels and a gyro, and four wheels in a pyramid."""

from __future__ import annotations

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ...faults import Fault, FaultySignals, with_faults
from ...faults.explanation import MARGIN
from ...faults.modelling import FaultModel
from ...filters import GeneralizedLikelihoodRatio, extended_kalman_filter
from ...plants import RigidSpacecraft, Wheels, fly, pyramid_axes, spacecraft_model
from ...plants.rigid_spacecraft import FILTER_STEP as STEP
from ...plants.wheels import wheel_names
from ...running.run import scan
from ..experiment import Experiment, Quantity, Record
from .scenarios import LOSS, OFFSET, OUTPUTS, SCENARIOS, StartsAtReading, injection, record_of

SIGNATURES, PYRAMID = "signatures", "pyramid"
FOUND = 40.0  # s; onset, where the wheels' commands are far from zero
DURATION = 45.0  # s
WINDOW = 100
"""Onsets looked back on [samples]: 5 s, so that the onset stays among them until the last decision."""
ALARM = 30.0
WAITS = (0.0, 0.5, 1.0, 2.0)  # s after the first alarm
RUNS = 10


def word(wait: float) -> str:
    """When a decision is made."""
    return "at the first alarm" if wait == 0 else f"{wait:g} s later"


@dataclasses.dataclass(frozen=True)
class Bench:
    """Faults of one size each, put one at a time into flights with the same noise.

    Attributes:
        craft: the spacecraft.
        faults: what may go wrong, and what the filter believes of it.
        sizes: of each when it happens, in the unit of its state.
        groups: what each is a fault of: an axis or a wheel.
    """

    craft: RigidSpacecraft
    faults: tuple[Fault, ...]
    sizes: tuple[float, ...]
    groups: tuple[int, ...]

    @property
    def model(self) -> FaultModel:
        """The filters' model: any of the faults may happen."""
        return with_faults(spacecraft_model(self.craft), self.faults)


@functools.cache
def bench(name: str) -> Bench:
    """Offsets, losses and gyro biases about three axes; or offsets and losses of four wheels in a pyramid."""
    if name == SIGNATURES:
        faults = tuple(fault for scenario in SCENARIOS for fault in scenario.faults())
        sizes = tuple(scenario.size * scenario.scale for scenario in SCENARIOS for _ in range(3))
        return Bench(RigidSpacecraft(), faults, sizes, (0, 1, 2) * 3)
    wheels = tuple(f"torque_{name}" for name in wheel_names(4))
    chosen = [dataclasses.replace(scenario, signals=wheels) for scenario in (OFFSET, LOSS)]
    faults = tuple(fault for scenario in chosen for fault in scenario.faults())
    sizes = tuple(scenario.size for scenario in chosen for _ in wheels)
    return Bench(RigidSpacecraft(wheels=Wheels(pyramid_axes())), faults, sizes, (0, 1, 2, 3) * 2)


class Flights(eqx.Module):
    """From a random key to flights with the same noise, each with another fault.

    Attributes:
        craft: the spacecraft.
        faults: kind and signal of each.
        sizes: of all faults in each flight (flights, faults).
    """

    craft: RigidSpacecraft
    faults: tuple[tuple[str, str], ...] = eqx.field(static=True)
    sizes: Float[Array, "flights faults"]

    def __call__(self, key: Array) -> Record:
        return jax.lax.map(lambda sizes: self._flight(key, sizes), self.sizes)

    def _flight(self, key: Array, sizes: Array) -> Record:
        until = float("inf")
        injected = tuple(
            injection(kind, signal, sizes[i], FOUND, until) for i, (kind, signal) in enumerate(self.faults)
        )
        torques = tuple(f"torque_{name}" for name in wheel_names(self.craft.wheels.count))
        flight = fly(
            self.craft,
            key=key,
            duration=DURATION,
            actuator_fault=FaultySignals(torques, injected),
            sensor_fault=FaultySignals(OUTPUTS, injected),
        )
        return record_of(flight)


class Ranking(eqx.Module):
    """How well each fault explains a flight, row by row, and which it was.

    Attributes:
        scores: twice the log likelihood ratio of each (T, k).
        truth: which it was.
    """

    scores: Float[Array, "T k"]
    truth: Int[Array, ""]


class Isolator(eqx.Module):
    """A bank that never takes a jump into its estimate, on one of the flights: its hypotheses stay and can be ranked.

    Attributes:
        bank: of jumps.
        model: with all faults.
        flight: which of them.
    """

    bank: GeneralizedLikelihoodRatio
    model: FaultModel
    flight: Int[Array, ""]

    def __call__(self, record: Record) -> Ranking:
        own = jax.tree.map(lambda values: values[self.flight], record)
        info = scan(self.bank, self.model, StartsAtReading(self.model)(own), own.samples)[1]
        return Ranking(info.memory.statistic, self.flight)


class Judge(eqx.Module):
    """What is decided at the first alarm and after it.

    Attributes:
        groups: what each fault is a fault of (k,).
    """

    groups: Int[Array, " k"]

    def __call__(self, record: Record, ranking: Ranking) -> dict[str, Array]:
        t, scores, truth = record.truth["t"][0], ranking.scores, ranking.truth
        high = jnp.max(scores, axis=1) > ALARM
        first, found = jnp.argmax(high), jnp.any(high)
        out: dict[str, Array] = {"delay": jnp.where(found, t[first] - FOUND, jnp.inf)}
        for wait in WAITS:
            row = scores[jnp.minimum(first + round(wait / STEP), len(t) - 1)]
            best = jnp.argmax(row)
            alone = jnp.sum(row > row[best] - MARGIN) == 1
            # An alarm before there is a fault finds nothing.
            due = found & (t[first] >= FOUND)
            out[f"group_{wait:g}"] = due & (self.groups[best] == self.groups[truth])
            out[f"right_{wait:g}"] = due & (best == truth)
            out[f"certain_{wait:g}"] = due & (best == truth) & alone
            out[f"misled_{wait:g}"] = (best != truth) & alone
        return out


class Scores(eqx.Module):
    """The scores of the last seconds, for the figure and for what is said in words."""

    def __call__(self, record: Record, ranking: Ranking) -> dict[str, Array]:
        return {"scores": ranking.scores[record.truth["t"].shape[1] - round((DURATION - FOUND) / STEP) - 1 :]}


QUANTITIES = (
    Quantity("delay", "delay of the first alarm", "s", "median"),
    *(
        Quantity(f"{what}_{wait:g}", f"{title} {word(wait)}", statistic="share")
        for wait in WAITS
        for what, title in (
            ("group", "right axis or wheel"),
            ("right", "right fault leads"),
            ("certain", "right fault named alone"),
            ("misled", "wrong fault named alone"),
        )
    ),
)


def experiment(name: str, title: str) -> Experiment:
    """The flights of a bench, one contender per fault that happens."""
    given = bench(name)
    model = given.model
    bank = GeneralizedLikelihoodRatio(
        extended_kalman_filter(), window=WINDOW, threshold=float("inf"), bounds=model.bounds
    )
    return Experiment(
        name,
        title,
        Flights(given.craft, tuple((f.kind, f.signal) for f in given.faults), jnp.diag(jnp.asarray(given.sizes))),
        {fault.name: Isolator(bank, model, jnp.asarray(k)) for k, fault in enumerate(given.faults)},
        Judge(jnp.asarray(given.groups)),
        QUANTITIES,
        Scores(),
        most_runs=RUNS,
    )
