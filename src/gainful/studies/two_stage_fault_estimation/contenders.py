"""The filters compared: the paper's two, its adaptation read in several ways, and rivals tuned as fairly."""

from __future__ import annotations

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from ...faults.modelling import FaultModel
from ...filters import (
    AbstractEstimator,
    GeneralizedLikelihoodRatio,
    Info,
    InteractingMultipleModel,
    KalmanFilter,
    extended_kalman_filter,
    two_stage_unscented_kalman_filter,
    unscented_kalman_filter,
)
from ...noise import Scaled
from ...running.fixed_lag import fixed_lag
from ...updates import AbstractUpdate, InnovationScaling, StrongTracking
from ..experiment import Contender, Record
from .scenarios import OUTPUTS, Scenario, StartsAtReading

PUBLISHED, TUNED = "TSUKF, published Qb", "TSUKF, tuned Qb"
LITERAL, GATED, GATED_BIAS, PAPER = (
    "ATSUKF literal",
    "ATSUKF gated (bias, state)",
    "ATSUKF gated (bias)",
    "ATSUKF as in the figures",
)
GLR, IMM, IMM_RESTLESS = "GLR", "IMM, tuned", "IMM, restless"
TRACKING, TRACKING_USUAL = "strong tracking, tuned", "strong tracking, usual"
EKF, UKF = "augmented EKF, tuned Qb", "augmented UKF, tuned Qb"
LAGGED = "tuned Qb, fixed lag of 1 s"
LAG = 1.0  # s


def _unscented(update: AbstractUpdate) -> KalmanFilter:
    return two_stage_unscented_kalman_filter(update=update)


def literal() -> KalmanFilter:
    """The adaptation as it is written: R, states and faults in this order, plain inverses, no gate."""
    return _unscented(InnovationScaling(order=("measurement", "state", "bias"), window=20, gate=1.0, weighted=False))


def gated(scenario: Scenario, window: int = 10) -> KalmanFilter:
    """The adaptation with a gate, faults first, bounded by the largest fault that is possible."""
    return _unscented(InnovationScaling(window=window, bounds=scenario.model().bounds))


def likelihood_ratio(scenario: Scenario, **options: Any) -> GeneralizedLikelihoodRatio:
    """Jump hypotheses on the quiet filter."""
    return GeneralizedLikelihoodRatio(two_stage_unscented_kalman_filter(), bounds=scenario.model().bounds, **options)


def two_models(
    scenario: Scenario, jump: float, staying: tuple[float, float] = (0.99999, 0.9)
) -> InteractingMultipleModel:
    """A quiet filter, and one whose faults walk by `jump` per step, in the scenario's unit.

    Args:
        scenario: of the fault.
        jump: sigma per step.
        staying: probability per step of staying quiet, and of going on jumping.
    """
    quiet = two_stage_unscented_kalman_filter()
    # Both are scaled, one by 1: members that differ in numbers only are compiled together.
    still, jumping = (Scaled(dict.fromkeys(scenario.states, factor)) for factor in (1.0, jump / scenario.walk))
    first, second = staying
    return InteractingMultipleModel(
        (dataclasses.replace(quiet, noise=still), dataclasses.replace(quiet, noise=jumping)),
        ((first, 1 - first), (1 - second, second)),
        (1.0, 0.0),
    )


def strong_tracking(memory: float = 0.95, softening: float = 4.0) -> KalmanFilter:
    """The filter that keeps its innovations as large as predicted."""
    return _unscented(StrongTracking(memory=memory, softening=softening))


def contenders(scenario: Scenario) -> dict[str, Any]:
    """All filters of a scenario by name."""
    model, larger = scenario.model(), scenario.model(scenario.tuned)
    bounds = model.bounds
    quiet = two_stage_unscented_kalman_filter()
    conservative = Scaled(outputs=dict.fromkeys(OUTPUTS, 2.0))
    figures = _unscented(InnovationScaling(order=("bias",), window=20, gate=1.0, bounds=bounds))
    published: dict[str, AbstractEstimator] = {
        PUBLISHED: quiet,
        LITERAL: literal(),
        GATED: gated(scenario),
        GATED_BIAS: _unscented(InnovationScaling(order=("bias",), bounds=bounds)),
        PAPER: dataclasses.replace(figures, noise=conservative),
        GLR: likelihood_ratio(scenario),
        IMM: two_models(scenario, scenario.jump),
        IMM_RESTLESS: two_models(scenario, scenario.restless, (0.999, 0.5)),
        TRACKING: strong_tracking(0.5, 2.0),
        TRACKING_USUAL: strong_tracking(),
    }
    tuned: dict[str, AbstractEstimator] = {
        TUNED: quiet,
        EKF: extended_kalman_filter(),
        UKF: unscented_kalman_filter(),
    }
    found: dict[str, Any] = {name: started(each, model) for name, each in published.items()}
    found |= {name: started(each, larger) for name, each in tuned.items()}
    return found | {LAGGED: Delayed(found[TUNED], LAG)}


def started(estimator: AbstractEstimator, model: FaultModel) -> Contender:
    """A contender that starts at the first reading.

    Its numbers are arrays, so that contenders that differ in nothing else share a program.
    """
    made = Contender(estimator, model, StartsAtReading(model))
    return jax.tree.map(lambda leaf: jnp.asarray(leaf) if isinstance(leaf, float) else leaf, made)


class Delayed(eqx.Module):
    """A contender whose estimates wait for the record to go on.

    Attributes:
        contender: with a `KalmanFilter`.
        lag: how long they wait [s].
    """

    contender: Contender
    lag: float

    def __call__(self, record: Record) -> Info:
        made, filtered = self.contender, self.contender.estimator
        assert isinstance(filtered, KalmanFilter)
        return fixed_lag(filtered, made.model, record.samples, made(record), self.lag)
