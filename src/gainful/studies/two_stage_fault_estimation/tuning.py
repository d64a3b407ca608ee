"""The grids on which the rivals were tuned, on other flights than those they are judged on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...errors import ConfigError, did_you_mean
from ...filters import two_stage_unscented_kalman_filter
from ..tuning import Tuning, tune
from .contenders import GLR, IMM, TRACKING, TUNED, likelihood_ratio, started, strong_tracking, two_models
from .estimation import experiment
from .scenarios import Scenario

SEED = 11
RUNS = 6
WALKS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Factors on the tuned walk of the faults."""
JUMPS = (0.5, 1.0, 2.0)
"""Factors on the sigma of the jumps."""
STAYING = ((0.99999, 0.9), (0.9999, 0.7), (0.999, 0.5))
MEMORIES, SOFTENINGS = (0.5, 0.8, 0.95), (1.0, 2.0, 4.0)
WINDOWS, THRESHOLDS = (60, 120), (20.0, 25.0, 30.0)


def walks(scenario: Scenario) -> dict[str, Any]:
    """The plain filter by the walk of its faults."""
    return {
        f"Qb sigma x {factor * scenario.tuned:g}": started(
            two_stage_unscented_kalman_filter(), scenario.model(factor * scenario.tuned)
        )
        for factor in WALKS
    }


def banks(scenario: Scenario) -> dict[str, Any]:
    """The bank of two models by jumps and probabilities of staying."""
    return {
        f"jump {factor * scenario.jump:g}, stay {staying[0]:g} and {staying[1]:g}": started(
            two_models(scenario, factor * scenario.jump, staying), scenario.model()
        )
        for factor in JUMPS
        for staying in STAYING
    }


def fadings(scenario: Scenario) -> dict[str, Any]:
    """Strong tracking by memory and softening."""
    return {
        f"rho {memory:g}, beta {softening:g}": started(strong_tracking(memory, softening), scenario.model())
        for memory in MEMORIES
        for softening in SOFTENINGS
    }


def ratios(scenario: Scenario) -> dict[str, Any]:
    """Likelihood ratios by window and threshold."""
    return {
        f"window {window}, threshold {threshold:g}": started(
            likelihood_ratio(scenario, window=window, threshold=threshold), scenario.model()
        )
        for window in WINDOWS
        for threshold in THRESHOLDS
    }


GRIDS: dict[str, Callable[[Scenario], dict[str, Any]]] = {TUNED: walks, IMM: banks, TRACKING: fadings, GLR: ratios}
"""Settings to try, by the name of the contender."""


def retune(contender: str, scenario: Scenario, *, runs: int = RUNS, seed: int = SEED) -> Tuning:
    """Repeat the tuning of a contender: all settings of its grid, and the one with the least error of the fault.

    Args:
        contender: of `GRIDS`.
        scenario: the fault; each was tuned by itself, save strong tracking, which has one setting for all.
        runs: flights per setting.
        seed: of the flights; another than the study's.

    Raises:
        ConfigError: the contender has no grid.
    """
    if contender not in GRIDS:
        raise ConfigError(f"contender: {contender!r} was not tuned; {did_you_mean(contender, GRIDS)}")
    settings = GRIDS[contender](scenario)
    return tune(experiment(scenario, settings), settings, "rmse", runs=runs, seed=seed)
