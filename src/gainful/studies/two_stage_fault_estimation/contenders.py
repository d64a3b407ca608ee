"""The filters compared: the paper's two, its adaptation read in several ways, and rivals tuned as fairly."""

from __future__ import annotations

import dataclasses

from ...filters import (
    AbstractEstimator,
    GeneralizedLikelihoodRatio,
    InteractingMultipleModel,
    KalmanFilter,
    extended_kalman_filter,
    two_stage_extended_kalman_filter,
    two_stage_unscented_kalman_filter,
    unscented_kalman_filter,
)
from ...noise import Scaled
from ...updates import AbstractUpdate, InnovationScaling, StrongTracking
from ..experiment import Contender
from .scenarios import OUTPUTS, Scenario, StartsAtReading

PUBLISHED, TUNED = "TSUKF, published Qb", "TSUKF, tuned Qb"
LITERAL, GATED, GATED_BIAS, PAPER = (
    "ATSUKF literal",
    "ATSUKF gated (bias, state)",
    "ATSUKF gated (bias)",
    "ATSUKF as in the figures",
)
GLR, IMM, TRACKING, TRACKING_USUAL = "GLR", "IMM, tuned", "strong tracking, tuned", "strong tracking, usual"
EKF, UKF = "augmented EKF, tuned Qb", "augmented UKF, tuned Qb"
EXTENDED = "TSEKF, published Qb"


def _unscented(update: AbstractUpdate) -> KalmanFilter:
    return two_stage_unscented_kalman_filter(update=update)


def contenders(scenario: Scenario) -> dict[str, Contender]:
    """All filters of a scenario by name."""
    model, larger = scenario.model(), scenario.model(scenario.tuned)
    bounds = model.bounds
    quiet = two_stage_unscented_kalman_filter()
    jump = Scaled(dict.fromkeys(scenario.states, scenario.jump / scenario.walk))
    bank = InteractingMultipleModel(
        (quiet, dataclasses.replace(quiet, noise=jump)),
        ((0.99999, 0.00001), (0.1, 0.9)),
        (1.0, 0.0),
    )
    conservative = Scaled(outputs=dict.fromkeys(OUTPUTS, 2.0))
    figures = _unscented(InnovationScaling(order=("bias",), window=20, gate=1.0, bounds=bounds))
    literal = InnovationScaling(order=("measurement", "state", "bias"), window=20, gate=1.0, weighted=False)
    published: dict[str, AbstractEstimator] = {
        PUBLISHED: quiet,
        LITERAL: _unscented(literal),
        GATED: _unscented(InnovationScaling(bounds=bounds)),
        GATED_BIAS: _unscented(InnovationScaling(order=("bias",), bounds=bounds)),
        PAPER: dataclasses.replace(figures, noise=conservative),
        GLR: GeneralizedLikelihoodRatio(quiet, bounds=bounds),
        IMM: bank,
        TRACKING: _unscented(StrongTracking(memory=0.5, softening=2.0)),
        TRACKING_USUAL: _unscented(StrongTracking()),
    }
    tuned: dict[str, AbstractEstimator] = {
        TUNED: quiet,
        EKF: extended_kalman_filter(),
        UKF: unscented_kalman_filter(),
    }
    return {name: Contender(each, model, StartsAtReading(model)) for name, each in published.items()} | {
        name: Contender(each, larger, StartsAtReading(larger)) for name, each in tuned.items()
    }


def kinds(scenario: Scenario) -> dict[str, Contender]:
    """The extended and the unscented filter, nothing else different."""
    model = scenario.model()
    pair = {EXTENDED: two_stage_extended_kalman_filter(), PUBLISHED: two_stage_unscented_kalman_filter()}
    return {name: Contender(each, model, StartsAtReading(model)) for name, each in pair.items()}
