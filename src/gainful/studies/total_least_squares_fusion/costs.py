"""What a sample costs."""

from __future__ import annotations

import functools

import jax
import numpy as np

from ...diagnostics import StepCost, step_cost, step_seconds
from ...diagnostics.cost import Problem
from ...filters import AbstractEstimator
from ...regression import RayleighTotalLeastSquares, RecursiveLeastSquares, RecursiveTotalLeastSquares, readings
from ...running import make_log
from ..chapter import Chapter
from ..claims import Check, Claim, above
from ..figures import Table
from ..outcome import Outcome
from ..statistics import Measured, exactly
from .contenders import problem
from .records import STEP, YAW, noisy_rows, rows_of

LS, PUBLISHED, ROOT, EXACT = "RLS", "RTLS, covariance form", "RTLS, square-root form", "RTLS, exact"
SEARCH, GAIN = "FRTLS", "FRTLS along the gain"
ROWS, TURNS = 400, 5
ESTIMATORS: dict[str, AbstractEstimator] = {
    LS: RecursiveLeastSquares(),
    PUBLISHED: RecursiveTotalLeastSquares(form="covariance", gap_gate=False),
    ROOT: RecursiveTotalLeastSquares(gap_gate=False),
    EXACT: RecursiveTotalLeastSquares(form="exact", gap_gate=False),
    SEARCH: RayleighTotalLeastSquares(gap_gate=False),
    GAIN: RayleighTotalLeastSquares(direction="gain", gap_gate=False),
}
"""Recursions of the two sensors' rows."""


@functools.cache
def problems() -> dict[str, Problem]:
    """Each recursion along the same rows."""
    model, prior = problem()
    rows = np.asarray(rows_of(noisy_rows(YAW, (0.1, 0.1), ROWS)(jax.random.key(0))))
    log = make_log(model, STEP * np.arange(1, ROWS + 1), *readings(rows), start=0.0)
    return {name: (estimator, model, prior, log) for name, estimator in ESTIMATORS.items()}


@functools.cache
def counted() -> dict[str, StepCost]:
    """Operations per step."""
    return {name: step_cost(*each) for name, each in problems().items()}


@functools.cache
def timed() -> dict[str, float]:
    """Seconds per step on this machine."""
    return step_seconds(problems(), TURNS)


def tables(outcome: Outcome) -> list[Table]:
    """Operations and times."""
    rows = tuple(
        (name, found.operations, found.carried, f"{1e6 * timed()[name]:.1f}") for name, found in counted().items()
    )
    heads = ("Recursion", "operations", "numbers carried", f"time on this machine, median of {TURNS} turns [µs]")
    return [Table("A sample of two sensors with three regressors: what it costs", heads, rows)]


def _operations(above_all: str, under: str) -> Measured:
    return exactly(counted()[above_all].operations / counted()[under].operations)


CLAIMS = (
    Claim(
        "cost of searches (5)",
        "FRTLS costs more than RTLS.",
        "in words",
        (
            Check("operations over those of the covariance form", lambda _: _operations(SEARCH, PUBLISHED), above(1.0)),
            Check("operations over those of the square-root form", lambda _: _operations(SEARCH, ROOT), above(1.0)),
            Check("more by half than the covariance form", lambda _: _operations(SEARCH, PUBLISHED), above(1.5)),
        ),
        {
            "partly": "A little more: both keep the same sums, and the spectrum that tells information from noise costs either "
            "more than its own step."
        },
    ),
)


def chapter() -> Chapter:
    """There is nothing random in it."""
    return Chapter(
        (),
        CLAIMS,
        tables,
        notes=(
            "Costs: operations are counted on the traced program, the spectrum that tells information from noise included, "
            "which the published recursions do without.",
        ),
    )
