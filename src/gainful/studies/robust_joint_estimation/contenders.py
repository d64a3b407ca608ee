"""The filters compared: one extended Kalman filter of states and parameters, with an update for every school."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ...estimates import Gaussian
from ...filters import extended_kalman_filter
from ...filters.base import Info
from ...models import AugmentedModel, augment
from ...plants import hydraulic_servo_reduced
from ...plants.hydraulic_servo_parameters import STEP
from ...plants.hydraulic_servo_record import told_variances
from ...plants.hydraulic_servo_reduced import MEASUREMENT_SIGMAS, PROCESS_SIGMAS
from ...running import AbstractDisturbance, make_prior
from ...updates import (
    AbstractUpdate,
    ChangeDetection,
    Exact,
    Gated,
    HuberReweighted,
    MasreliezMartin,
    MaximumCorrentropy,
    StudentT,
    WeightedLikelihood,
    huber_threshold,
)
from ..experiment import Contender, Record
from .records import WALK

NOMINAL, TOTAL, TOLD = "EKF, R nominal", "EKF, R total", "EKF that knows the outliers"
RA, EXPECTATION, DETECTOR = "RA", "RA, expectation", "RA with detector"
GATE, IRLS, STUDENT, CORRENTROPY, WOLF = "gate at 4 sigma", "IRLS", "Student-t", "correntropy", "WoLF"

START = (0.0, 0.0, 0.0, 0.6, 1.4)
START_VARIANCES = (0.01, 0.01, 0.1, 0.25, 0.25)
TUNED = {
    NOMINAL: 0.003,
    TOTAL: 0.01,
    RA: 0.01,
    EXPECTATION: 0.02,
    DETECTOR: 0.003,
    GATE: 0.01,
    IRLS: 0.01,
    STUDENT: 0.01,
    CORRENTROPY: 0.01,
    WOLF: 0.02,
}
"""The walk per sample with which each does best on parameters that change, found by `tuning.tuned` on other seeds."""
JUMP = math.sqrt(0.1)
"""Standard deviation of a jump of a parameter, as the detector has it."""


def threshold(contamination: float) -> Any:
    """Huber's threshold as an array, so that filters that differ in it alone share a program."""
    return jnp.asarray(huber_threshold(contamination))


@functools.cache
def update(name: str, contamination: float = 0.1) -> AbstractUpdate:
    """The update of a school.

    Args:
        name: of the filter.
        contamination: share of outliers that a filter with Huber's threshold expects.
    """
    k = threshold(contamination)
    robust = MasreliezMartin(threshold=k)
    return {
        NOMINAL: Exact(),
        TOTAL: Exact(),
        TOLD: Exact(),
        RA: robust,
        EXPECTATION: MasreliezMartin(threshold=k, covariance="expectation"),
        DETECTOR: ChangeDetection(jumps={"p1": JUMP, "p2": JUMP}, inner=robust),
        GATE: Gated(probability=math.erf(4.0 / math.sqrt(2.0)), by="component", reacquire=0),
        IRLS: HuberReweighted(threshold=k),
        STUDENT: StudentT(),
        CORRENTROPY: MaximumCorrentropy(),
        WOLF: WeightedLikelihood(),
    }[name]


SCHOOLS = (NOMINAL, TOTAL, RA, EXPECTATION, DETECTOR, GATE, IRLS, STUDENT, CORRENTROPY, WOLF)
"""Filters that anybody could build: all but the one that is told the outliers."""


@dataclasses.dataclass(frozen=True)
class Belief:
    """What a filter believes of the axis.

    Attributes:
        walk: standard deviation of a parameter's change per sample.
        scale: of the variances of the readings, over nominal.
        start: mean before the first sample.
        variances: before the first sample.
        process_sigmas: of the noise of the states per sample.
        asymmetric: whether the valve's flow differs between the directions.
    """

    walk: float = WALK
    scale: float = 1.0
    start: tuple[float, ...] = START
    variances: tuple[float, ...] = START_VARIANCES
    process_sigmas: tuple[float, float, float] = PROCESS_SIGMAS
    asymmetric: bool = False


@functools.cache
def believed(belief: Belief, *, told: bool = False) -> tuple[AugmentedModel, Gaussian]:
    """The joint model of states and parameters, and the estimate before the first sample; the same ones each time.

    Args:
        belief: what they are made of.
        told: whether the model is told the variance of every single reading.
    """
    servo = hydraulic_servo_reduced(
        asymmetric=belief.asymmetric,
        process_sigmas=belief.process_sigmas,
        measurement_sigmas=tuple(np.asarray(MEASUREMENT_SIGMAS) * math.sqrt(belief.scale)),
        told_variances=told,
    )
    model = augment(servo, parameters=dict.fromkeys(("p1", "p2"), belief.walk / math.sqrt(STEP)))
    return model, make_prior(model, belief.start, np.sqrt(belief.variances))


class ToldContender(eqx.Module):
    """A contender that is told the variance of every single reading."""

    contender: Contender

    def __call__(self, record: Record) -> Info:
        return self.contender(Record(told_variances(record.samples, record.truth["variance"]), record.truth))


def contender(name: str, belief: Belief = Belief(), *, contamination: float = 0.1) -> Contender | ToldContender:
    """A filter by name.

    Args:
        name: of the filter.
        belief: what it believes of the axis.
        contamination: share of outliers that a filter with Huber's threshold expects.
    """
    told = name == TOLD
    made = Contender(extended_kalman_filter(update=update(name, contamination)), *believed(belief, told=told))
    return ToldContender(made) if told else made


def total(noise: AbstractDisturbance) -> float:
    """Mean square of a noise over its nominal variance."""
    return float(noise.mean_square(jnp.ones(1))[0])


def believing(name: str, noise: AbstractDisturbance, belief: Belief) -> Belief:
    """What a filter of that name believes: all take the readings' nominal variance but the one with the total."""
    return dataclasses.replace(belief, scale=total(noise)) if name == TOTAL else belief
