"""The three faults of the experiment, and the flights in which they happen."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...estimates import Gaussian
from ...faults import (
    AbstractInjection,
    Bias,
    Fault,
    FaultySignals,
    Loss,
    actuator_offset,
    loss_of_effectiveness,
    sensor_bias,
    with_faults,
)
from ...faults.modelling import FaultModel
from ...models import Instant, Sample
from ...models.base import block_diagonal
from ...plants import RigidSpacecraft, fly, spacecraft_model
from ...plants.attitude_forms import AbstractAttitudeForm
from ...plants.rigid_spacecraft import GYRO_SIGMA, STAR_TRACKER_SIGMA
from ...running.loop import Simulated
from ..experiment import Record

DEGREE = math.pi / 180.0  # rad
ONSET, END = 50.0, 150.0  # s
DURATION = 200.0  # s
CALIBRATION = 1012
"""Folded into the keys of flights on which thresholds are found."""
STATES = 6
"""Rates and angles; the faults come after them."""


@dataclasses.dataclass(frozen=True)
class Scenario:
    """A fault about the x axis, and what the filters believe of faults of its kind about all three.

    Attributes:
        name: on the command line and in claims.
        title: for people.
        kind: of `Fault`.
        signals: that such a fault may be in, the faulty one first.
        unit: in which sizes are told.
        scale: of that unit.
        size: of the fault, in that unit.
        walk: published sigma of a fault's change per step, in that unit.
        sigma: of a fault before the start, in that unit.
        bound: largest fault thought possible, in that unit.
        tuned: factor on `walk` with the least error, found on other seeds.
        jump: sigma of a jump in the tuned bank of two models, in that unit.
        restless: likewise in one that jumps more readily: less error after the loss, more while nothing happens.
    """

    name: str
    title: str
    kind: str
    signals: tuple[str, str, str]
    unit: str
    scale: float
    size: float
    walk: float
    sigma: float
    bound: float
    tuned: float
    jump: float
    restless: float

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the fault states."""
        return tuple(f"{self.kind}_{signal}" for signal in self.signals)

    def faults(self, factor: float = 1.0) -> list[Fault]:
        """What the filters believe of the faults, with the published walk times a factor."""
        make = {"offset": actuator_offset, "loss": loss_of_effectiveness, "bias": sensor_bias}[self.kind]
        size = self.scale
        return [
            make(
                signal, walk=factor * self.walk * size, sigma=self.sigma * size, bound=self.bound * size, per_step=True
            )
            for signal in self.signals
        ]

    def model(self, factor: float = 1.0, *, readings: float = 1.0) -> FaultModel:
        """The filters' model, with the published walk times a factor, and the sensors' sigmas times another."""
        believed = RigidSpacecraft(gyro_sigma=readings * GYRO_SIGMA, star_tracker_sigma=readings * STAR_TRACKER_SIGMA)
        return with_faults(spacecraft_model(believed), self.faults(factor))


TORQUES = ("torque_x", "torque_y", "torque_z")
GYROS = ("gyro_x", "gyro_y", "gyro_z")
OUTPUTS = (*GYROS, "star_phi", "star_theta", "star_psi")

OFFSET = Scenario(
    name="offset",
    title="Wheel torque offset",
    kind="offset",
    signals=TORQUES,
    unit="N m",
    scale=1.0,
    size=0.03,
    walk=2e-5,
    sigma=1e-3,
    bound=0.1,
    tuned=40.0,
    jump=0.01,
    restless=0.02,
)
LOSS = Scenario(
    name="loss",
    title="Loss of wheel effectiveness",
    kind="loss",
    signals=TORQUES,
    unit="1",
    scale=1.0,
    size=0.5,
    walk=2e-4,
    sigma=1e-2,
    bound=1.0,
    tuned=110.0,
    jump=0.3,
    restless=0.6,
)
GYRO = Scenario(
    name="gyro",
    title="Gyro bias",
    kind="bias",
    signals=GYROS,
    unit="deg/s",
    scale=DEGREE,
    size=0.1,
    walk=2e-7,
    sigma=1e-3,
    bound=1.0,
    tuned=13000.0,
    jump=0.05,
    restless=0.05,
)
SCENARIOS = (OFFSET, LOSS, GYRO)


def quiet_craft(**options: Any) -> RigidSpacecraft:
    """A spacecraft without noise and disturbance."""
    return RigidSpacecraft(**options, torque_density=0.0, gyro_sigma=0.0, star_tracker_sigma=0.0, disturbance=0.0)


def injection(kind: str, signal: str, size: Any, onset: float, end: float) -> AbstractInjection:
    """A fault of a kind put into a flight."""
    return (Loss if kind == "loss" else Bias)(signal, size, onset, end)


def record_of(flight: Simulated, **truth: Array) -> Record:
    """A flight as filters get it: they start at the first reading and are judged from the second on."""
    t, y = flight.t, flight.y
    when = Instant(t[1:], jnp.diff(t), flight.u[1:])
    # A reading has six degrees of freedom however its attitude is written.
    return Record(Sample(when, y[1:], jnp.ones((len(t) - 1, STATES), bool)), {"t": t[1:], "start": y[0]} | truth)


class Flight(eqx.Module):
    """From a random key to the record of a flight with a fault; the same noise whatever the fault.

    Attributes:
        actuator: fault of the wheels, if any.
        sensor: fault of the sensors, if any.
        size: of the fault, in the unit in which it is told.
        quiet: whether the flight is without noise and disturbance.
        form: of the attitude; angles relative to the target if None.
        other: folded into the key, for noise of its own; none for the noise that all faults share.
    """

    actuator: FaultySignals | None
    sensor: FaultySignals | None
    size: float
    quiet: bool = eqx.field(static=True, default=False)
    form: AbstractAttitudeForm | None = None
    other: int | None = eqx.field(static=True, default=None)

    def __call__(self, key: Array) -> Record:
        faults = {}
        if self.actuator is not None:
            faults["actuator_fault"] = self.actuator
        if self.sensor is not None:
            faults["sensor_fault"] = self.sensor
        craft = quiet_craft(form=self.form) if self.quiet else RigidSpacecraft(form=self.form)
        if self.other is not None:
            key = jax.random.fold_in(key, self.other)
        flight = fly(craft, key=key, duration=DURATION, **faults)
        present = jnp.where(selected(flight.t, ONSET, END), self.size, 0.0)
        return record_of(flight, states=flight.truth[1:], fault=present[1:])


def flight_of(scenario: Scenario, *, form: AbstractAttitudeForm | None = None, quiet: bool = False) -> Flight:
    """The flight of a scenario."""
    injected = injection(scenario.kind, scenario.signals[0], scenario.size * scenario.scale, ONSET, END)
    on_sensor = scenario.kind == "bias"
    fault = FaultySignals(OUTPUTS if on_sensor else TORQUES, (injected,))
    return Flight(None if on_sensor else fault, fault if on_sensor else None, scenario.size, quiet, form)


def sound_flight() -> Flight:
    """A flight without a fault, with noise of its own: what thresholds are found on."""
    return Flight(None, None, 0.0, other=CALIBRATION)


class StartsAtReading(eqx.Module):
    """The estimate before the first sample: the reading before it, as uncertain as readings are, and no fault yet."""

    model: FaultModel

    def __call__(self, record: Record) -> Gaussian:
        start = record.truth["start"]
        noise = self.model.base.measurement_noise(start, jax.tree.map(lambda leaf: leaf[0], record.samples.when))
        none = jnp.zeros(len(self.model.sigma))
        return Gaussian.start(
            jnp.concatenate([start, none]), block_diagonal([noise, jnp.diag(self.model.sigma**2)]), self.model.space
        )


def selected(t: Float[Array, " T"], start: float, end: float) -> Float[Array, " T"]:
    """Which rows lie in [start, end)."""
    return (t >= start) & (t < end)
