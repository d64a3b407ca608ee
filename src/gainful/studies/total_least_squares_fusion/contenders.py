"""The recursions compared, and which sensors each is given: alone, stacked or averaged first."""

from __future__ import annotations

import functools
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Bool, Float

from ...estimates import Gaussian
from ...filters import AbstractEstimator, Info
from ...models import Instant, Sample
from ...regression import (
    Fit,
    RayleighTotalLeastSquares,
    RecursiveLeastSquares,
    RecursiveTotalLeastSquares,
    RegressionModel,
    instrumental_variables,
    regression_model,
)
from ...running import make_prior
from ...running.run import scan
from ..experiment import Record
from .records import PARAMETERS, rows_of

RLS1, RLS2, RLS_F = "RLS1", "RLS2", "RLS_F"
RTLS1, RTLS2, RTLS_F = "RTLS1", "RTLS2", "RTLS_F"
FRTLS, COLD = "FRTLS", "FRTLS, cold start"
MEAN_RLS, MEAN_RTLS, CROSS = "RLS of the mean", "RTLS of the mean", "IV across sensors"
PUBLISHED = (RLS1, RLS2, RLS_F, RTLS1, RTLS2, FRTLS, RTLS_F)
"""The paper's seven."""
WARM_START = 100
"""Rows of least squares before the first line search."""
UNKNOWN = 1e3
"""Standard deviation of the parameters before the first row, in their units."""


@functools.cache
def problem() -> tuple[RegressionModel, Gaussian]:
    """The regression of two sensors, and parameters that are as good as unknown; the same ones each time."""
    model = regression_model(PARAMETERS, ("first", "second"))
    return model, make_prior(model, [0.0] * len(PARAMETERS), [UNKNOWN] * len(PARAMETERS))


class Sensors(eqx.Module):
    """A contender: a recursion and what it is given of the sensors. Those that differ in that alone share a program.

    Attributes:
        estimator: what steps.
        model: of the regression.
        prior: of the parameters.
        mixing: of the sensors' rows, such as their mean (2, 2).
        seen: which of the mixed rows there are (2,).
    """

    estimator: AbstractEstimator
    model: RegressionModel
    prior: Gaussian
    mixing: Float[Array, "2 2"]
    seen: Bool[Array, "2"]

    def __call__(self, record: Record) -> Info:
        when, rows = record.samples.when, jnp.einsum("ij,tjp->tip", self.mixing, rows_of(record))
        mixed = Instant(when.t, when.dt, rows[..., :-1].reshape(len(rows), -1))
        samples = Sample(mixed, rows[..., -1], record.samples.seen & self.seen)
        return scan(self.estimator, self.model, self.prior, samples)[1]


class AcrossSensors(eqx.Module):
    """A contender: all rows at once, each sensor the instrument of the other."""

    def __call__(self, record: Record) -> Fit:
        rows = rows_of(record)
        return instrumental_variables(rows[:, 0], rows[:, 1])


def alone(estimator: AbstractEstimator, sensor: int) -> Sensors:
    """A recursion of one sensor.

    Args:
        estimator: what steps.
        sensor: 0 or 1.
    """
    return Sensors(estimator, *problem(), jnp.eye(2), jnp.arange(2) == sensor)


def stacked(estimator: AbstractEstimator) -> Sensors:
    """A recursion of the rows of both, as the paper fuses them."""
    return Sensors(estimator, *problem(), jnp.eye(2), jnp.ones(2, bool))


def averaged(estimator: AbstractEstimator, weights: tuple[float, float] = (1.0, 1.0)) -> Sensors:
    """A recursion of the sensors' mean row.

    Args:
        estimator: what steps.
        weights: of the sensors in the mean.
    """
    shares = jnp.asarray(weights) / sum(weights)
    return Sensors(estimator, *problem(), jnp.stack([shares, jnp.zeros(2)]), jnp.array([True, False]))


def least_squares(forgetting: float = 1.0) -> RecursiveLeastSquares:
    """Recursive least squares; its numbers are arrays, so that all share a program."""
    return RecursiveLeastSquares(_arrays((1.0, 1.0)), jnp.asarray(forgetting))  # type: ignore[arg-type]


def total_least_squares(
    weights: tuple[float, float] = (1.0, 1.0), forgetting: float = 1.0, *, gate: bool = False
) -> RecursiveTotalLeastSquares:
    """Recursive total least squares, isotropic, likewise.

    Args:
        weights: of the sensors.
        forgetting: how much a row counts one step later.
        gate: whether the eigenvalue gap must exceed what noise alone would show, which the paper does not ask.
    """
    return RecursiveTotalLeastSquares(_arrays(weights), jnp.asarray(forgetting), gap_gate=gate)  # type: ignore[arg-type]


def line_searches(warm_start: int = WARM_START) -> RayleighTotalLeastSquares:
    """Total least squares by line searches.

    Args:
        warm_start: rows of least squares before the first.
    """
    return RayleighTotalLeastSquares(_arrays((1.0, 1.0)), gap_gate=False, warm_start=warm_start)


def everybody() -> dict[str, Sensors | AcrossSensors]:
    """The paper's seven, a line search that starts from nothing, and what else two equal sensors can be used for."""
    return {
        RLS1: alone(least_squares(), 0),
        RLS2: alone(least_squares(), 1),
        RLS_F: stacked(least_squares()),
        RTLS1: alone(total_least_squares(), 0),
        RTLS2: alone(total_least_squares(), 1),
        FRTLS: alone(line_searches(), 0),
        COLD: alone(line_searches(0), 0),
        RTLS_F: stacked(total_least_squares()),
        MEAN_RLS: averaged(least_squares()),
        MEAN_RTLS: averaged(total_least_squares()),
        CROSS: AcrossSensors(),
    }


def _arrays(numbers: tuple[float, ...]) -> tuple[Any, ...]:
    return tuple(jnp.asarray(each) for each in numbers)
