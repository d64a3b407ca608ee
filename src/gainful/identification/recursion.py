"""Parameters followed row by row along a recording."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float, Int

from ..filters import AbstractEstimator
from ..regression import (
    ConstantRowNoise,
    RayleighTotalLeastSquares,
    RecursiveLeastSquares,
    RecursiveTotalLeastSquares,
    readings,
    regression_model,
)
from ..regression.batch import Fit
from ..running import make_log, make_prior, run
from .methods import Problem, split

_VAGUE = 1e3
"""Standard deviation of the prior over the parameters' size."""


@dataclasses.dataclass(frozen=True)
class Track:
    """Estimates along a recording.

    Attributes:
        t: times [s] (T,).
        theta: the estimate after each row (T, n).
        std: standard deviations, as the recursion has them (T, n).
        status: a `Status` code per row (T,).
        cov: covariance at the end (n, n).
        forgetting: how much a row counted one row later.
    """

    t: Float[np.ndarray, "T"]
    theta: Float[np.ndarray, "T n"]
    std: Float[np.ndarray, "T n"]
    status: Int[np.ndarray, "T"]
    cov: Float[np.ndarray, "n n"]
    forgetting: float = 1.0


def follow(problem: Problem, method: str, forgetting: float = 1.0) -> Track:
    """The parameters by a recursive method.

    Args:
        problem: the equation and the recording.
        method: "rls", "rtls" or "frtls", with "weak-" in front on weak rows. Total least squares takes the covariance of a
            row as far as the noise of the signals is known, and equal noise in all columns else.
        forgetting: how much a row counts one row later.

    Raises:
        ConfigError: a forgetting factor that is none.
    """
    base, weak = split(method)
    rows, names = problem.rows(weak), problem.equation.parameters
    model = regression_model(dict.fromkeys(names, "1"), ("regressand",))
    start = problem.fit("weak-ls" if weak else "ls")
    result = run(
        _estimator(problem, base, weak, forgetting, start),
        model,
        make_prior(model, np.zeros(len(names)), _VAGUE * (np.abs(start.theta) + np.asarray(start.std))),
        make_log(model, problem.recording.t, *readings(rows[:, None, :])),
    )
    wider = _widening(problem, base, weak)
    cov = result.cov[-1] * np.outer(wider, wider)
    return Track(result.t, result.mean, result.std * wider, result.status, cov, forgetting)


def _widening(problem: Problem, base: str, weak: bool) -> Float[np.ndarray, "n"]:
    """By how much correlated residuals widen the bands: a recursion takes its rows to be independent."""
    form = "ls" if base == "rls" else "tls" if problem.row_noise(weak) is None else "gtls"
    found = problem.fit(f"weak-{form}" if weak else form)
    alone = problem.fit(f"weak-{form}" if weak else form, independent=True)
    return np.asarray(found.std / alone.std)


def _estimator(problem: Problem, base: str, weak: bool, forgetting: float, start: Fit) -> AbstractEstimator:
    if base == "rls":
        return RecursiveLeastSquares(weights=(float(1.0 / start.noise_scale),), forgetting=forgetting)
    noise = problem.row_noise(weak)
    row = ConstantRowNoise() if noise is None else ConstantRowNoise(tuple(map(tuple, noise.tolist())))
    kind = RecursiveTotalLeastSquares if base == "rtls" else RayleighTotalLeastSquares
    return kind(weights=(1.0,), forgetting=forgetting, noise=row)
