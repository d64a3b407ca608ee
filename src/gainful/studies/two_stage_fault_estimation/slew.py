"""A slew through 90 degrees of roll: a quaternion against Euler angles."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ...errors import Status
from ...faults import Bias, FaultySignals, with_faults
from ...faults.modelling import FaultModel
from ...filters import KalmanFilter, two_stage_extended_kalman_filter
from ...models import Sample
from ...plants import (
    AbstractAttitudeForm,
    InertialQuaternion,
    OrbitAngles,
    RigidSpacecraft,
    SlewTarget,
    euler312_to_quaternion,
    fly,
    spacecraft_model,
    tracking_controller,
)
from ...running.run import scan
from ...spaces import quaternion_conjugate, quaternion_multiply
from ..chapter import Chapter
from ..claims import Check, Claim, above, below
from ..experiment import Experiment, Quantity, Record
from ..figures import Chart, Figure, Line, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured, exactly
from .scenarios import DEGREE, OFFSET, ONSET, TORQUES, StartsAtReading, record_of, selected

SLEW = "slew"
QUATERNION, ANGLES = "quaternion", "Euler angles"
RATE = 2.0 * DEGREE  # rad/s: 90 degrees of roll after 45 s, 270 after 135 s
DURATION = 150.0  # s
END = 100.0  # s
RATE_GAIN = 0.6  # 1/s
SHOWN = 4
RUNS = 10


def target() -> SlewTarget:
    """Roll at a constant rate."""
    return SlewTarget(slope=jnp.array([RATE, 0.0, 0.0]))


class Slew(eqx.Module):
    """From a random key to one flight with a rate loop; a wheel's offset comes and goes on the way."""

    def __call__(self, key: Array) -> Record:
        craft = RigidSpacecraft(form=InertialQuaternion(target()), start_error=jnp.zeros(3))
        flight = fly(
            craft,
            tracking_controller(craft, k_p=0.0, k_d=RATE_GAIN),
            key=key,
            duration=DURATION,
            actuator_fault=FaultySignals(TORQUES, (Bias(TORQUES[0], OFFSET.size, ONSET, END),)),
        )
        fault = jnp.where(selected(flight.t, ONSET, END), OFFSET.size, 0.0)
        return record_of(flight, fault=fault[1:], attitude=flight.truth[1:, 3:])


class Estimated(eqx.Module):
    """What a filter of either form has found.

    Attributes:
        attitude: quaternion from body to inertial axes (T, 4).
        fault: offset of the x wheel [N m] (T,).
        status: of each step (T,).
    """

    attitude: Float[Array, "T 4"]
    fault: Float[Array, " T"]
    status: Int[Array, " T"]


class QuaternionFilter(eqx.Module):
    """A filter whose attitude is a quaternion with an error of three degrees of freedom.

    Attributes:
        estimator: what steps.
        model: in that form.
    """

    estimator: KalmanFilter
    model: FaultModel

    def __call__(self, record: Record) -> Estimated:
        info = scan(self.estimator, self.model, StartsAtReading(self.model)(record), record.samples)[1]
        mean = info.estimate.mean
        return Estimated(mean[:, 3:7], mean[:, 7], info.status)


class AngleFilter(eqx.Module):
    """A filter whose attitude are angles relative to the orbit; it is given the same readings, written as angles.

    Attributes:
        estimator: what steps.
        model: in that form.
        form: of the angles.
    """

    estimator: KalmanFilter
    model: FaultModel
    form: OrbitAngles

    def __call__(self, record: Record) -> Estimated:
        own, t = record.samples, record.truth["t"]
        y = jax.vmap(self._written)(own.y, t)
        start = self._written(record.truth["start"], jnp.zeros(()))
        told = Record(Sample(own.when, y, own.seen), record.truth | {"start": start})
        info = scan(self.estimator, self.model, StartsAtReading(self.model)(told), told.samples)[1]
        mean = info.estimate.mean
        orbit = jax.vmap(self.form.target.orbit)(t)
        attitude = jax.vmap(quaternion_multiply)(orbit, jax.vmap(euler312_to_quaternion)(mean[:, 3:6]))
        return Estimated(attitude, mean[:, 6], info.status)

    def _written(self, y: Array, t: Array) -> Array:
        return jnp.concatenate([y[:3], self.form.written(y[3:], t)])


def contenders() -> dict[str, QuaternionFilter | AngleFilter]:
    """The tuned two-stage extended filter of the wheels' offsets, in both forms."""
    estimator, orbit = two_stage_extended_kalman_filter(), OrbitAngles(target())
    return {
        QUATERNION: QuaternionFilter(estimator, _model(InertialQuaternion(target()))),
        ANGLES: AngleFilter(estimator, _model(orbit), orbit),
    }


def _model(form: AbstractAttitudeForm) -> FaultModel:
    return with_faults(spacecraft_model(RigidSpacecraft(form=form)), OFFSET.faults(OFFSET.tuned))


def attitude_error(record: Record, found: Estimated) -> Float[Array, " T"]:
    """Angle between the attitudes estimated and true [deg]."""

    def angle(one: Array, other: Array) -> Array:
        apart = quaternion_multiply(quaternion_conjugate(one), other)
        return 2.0 * jnp.arctan2(jnp.linalg.norm(apart[:3]), jnp.abs(apart[3]))

    return jax.vmap(angle)(record.truth["attitude"], found.attitude) / DEGREE


class Measure(eqx.Module):
    """From a flight and what a filter has found to the quantities."""

    def __call__(self, record: Record, found: Estimated) -> dict[str, Array]:
        error, off = attitude_error(record, found), found.fault - record.truth["fault"]
        return {
            "attitude": jnp.max(error),
            "fault": jnp.sqrt(jnp.mean(off**2)),
            "failed": jnp.sum(found.status >= Status.not_positive),
        }


class Traces(eqx.Module):
    """From the same to the series of the figure."""

    def __call__(self, record: Record, found: Estimated) -> dict[str, Array]:
        return {"error": attitude_error(record, found)[::SHOWN], "fault": found.fault[::SHOWN]}


def worst(outcome: Outcome, name: str, quantity: str) -> Measured:
    """The largest of all runs."""
    values = outcome.values(SLEW, name, quantity)
    return exactly(float(np.max(values)), outcome.quantity(SLEW, quantity).unit)


def tables(outcome: Outcome) -> list[Table]:
    """Medians and the worst of the runs, since few runs decide a mean."""
    rows = tuple(
        (
            name,
            *(
                cell
                for each in ("attitude", "fault")
                for cell in (outcome.median(SLEW, name, each), worst(outcome, name, each))
            ),
        )
        for name in (QUATERNION, ANGLES)
    )
    heads = ("largest attitude error [deg], median", "worst run", "fault RMSE [N m], median", "worst run")
    return [Table("Roll through 90 degrees", ("attitude as", *heads), rows)]


def figures(outcome: Outcome) -> list[Figure | Chart]:
    """Attitude error and fault of one flight."""
    truth = outcome.record(SLEW).truth
    t = truth["t"][::SHOWN]
    names = (QUATERNION, ANGLES)

    def lines(what: str) -> tuple[Line, ...]:
        return tuple(Line(name, t, outcome.trace(SLEW, name, what).first) for name in names)

    fault = Line("truth", t, truth["fault"][::SHOWN], reference=True)
    return [
        Figure(
            "Roll through 90 degrees",
            "One flight at 2 deg/s; the roll angle passes 90 degrees at 45 s and at 135 s, where the "
            "angles are singular.",
            (
                Panel("attitude error", lines("error"), "deg", log=True),
                Panel("offset of the x wheel", (fault, *lines("fault")), "N m"),
            ),
        )
    ]


def _ratio_of_medians(outcome: Outcome) -> Measured:
    medians = [float(np.median(outcome.values(SLEW, name, "attitude"))) for name in (ANGLES, QUATERNION)]
    return exactly(medians[0] / medians[1])


OURS = "not in the paper"
CLAIMS = (
    Claim(
        "quaternion through the singularity",
        "With a quaternion the slew is like any other manoeuvre.",
        OURS,
        (
            Check(
                "largest attitude error of all runs [deg]",
                lambda outcome: worst(outcome, QUATERNION, "attitude"),
                below(0.03),
            ),
            Check("fault RMSE, worst run [N m]", lambda outcome: worst(outcome, QUATERNION, "fault"), below(0.004)),
        ),
    ),
    Claim(
        "angles at the singularity",
        "Euler angles with wrapped innovations lose the attitude where roll passes 90 degrees.",
        OURS,
        (
            Check("largest attitude error, angles over quaternion, medians", _ratio_of_medians, above(10.0)),
            Check(
                "largest attitude error of all runs [deg]",
                lambda outcome: worst(outcome, ANGLES, "attitude"),
                above(1.0),
            ),
            Check("fault RMSE, worst run [N m]", lambda outcome: worst(outcome, ANGLES, "fault"), above(0.01)),
        ),
    ),
)


def chapter() -> Chapter:
    """A manoeuvre in which Euler angles are singular."""
    experiment = Experiment(
        SLEW,
        "Roll through 90 degrees",
        Slew(),
        contenders(),
        Measure(),
        (
            Quantity("attitude", "largest attitude error", "deg", "median"),
            Quantity("fault", "fault RMSE", "N m", "median"),
            Quantity("failed", "steps that failed"),
        ),
        Traces(),
        most_runs=RUNS,
    )
    return Chapter(
        (experiment,),
        CLAIMS,
        tables,
        figures,
        ("Roll through 90 degrees: both filters get the same readings, written as a quaternion or as angles.",),
    )
