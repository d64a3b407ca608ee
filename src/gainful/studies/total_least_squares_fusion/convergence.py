"""How many samples it takes."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from ..chapter import Chapter
from ..claims import Check, Claim, above, below
from ..figures import Table
from ..outcome import Outcome
from ..statistics import Measured, median_interval
from .contenders import COLD, MEAN_RTLS, PUBLISHED, RLS_F, RTLS_F
from .fusion import CASES, HEADS, to_singles
from .measures import AFTER

WITHIN = 0.1
"""Relative error below which an estimate has converged."""
NEAR = 1.5
"""Times its last error, within which least squares has converged to whatever it converges to."""


def settled(errors: Float[np.ndarray, "n T"], within: float) -> Measured:
    """After how many samples the median over runs stays below some error, and its interval: never is infinity.

    Args:
        errors: of every run, at the samples `AFTER`.
        within: the error.
    """
    order, ranks = np.sort(errors, axis=0), median_interval(np.arange(len(errors)))
    low, high = (_stays(_order_statistic(order, rank), within) for rank in (ranks.low, ranks.high))
    return Measured(_stays(np.median(errors, axis=0), within), low, high, len(errors))


def _order_statistic(ordered: Float[np.ndarray, "n T"], rank: float) -> Float[np.ndarray, "T"]:
    """The errors of a rank, infinite where the runs are too few for one."""
    return ordered[int(rank)] if math.isfinite(rank) else np.full(ordered.shape[1], rank)


def _stays(values: Float[np.ndarray, "T"], below: float) -> float:
    """The first of `AFTER` from which on values stay below a number."""
    outside = np.flatnonzero(values >= below)
    if not len(outside):
        return float(AFTER[0])
    return float(AFTER[outside[-1] + 1]) if outside[-1] + 1 < len(AFTER) else math.inf


def to_truth(outcome: Outcome, name: str, contender: str, within: float = WITHIN) -> Measured:
    """After how many samples a contender's median error stays within some of the truth."""
    return settled(outcome.every(name, contender, "error"), within)


def to_limit(outcome: Outcome, name: str, contender: str) -> Measured:
    """After how many samples a contender's median error stays within 1.5 times its last."""
    errors = outcome.every(name, contender, "error")
    return settled(errors, NEAR * float(np.median(errors[:, -1])))


def tables(outcome: Outcome) -> list[Table]:
    """Samples to the truth and, for least squares, to its limit."""
    names = (*PUBLISHED, COLD, MEAN_RTLS)
    rows = tuple((each, *(to_truth(outcome, name, each) for name in CASES)) for each in names)
    limits = tuple((each, *(to_limit(outcome, name, each) for name in CASES)) for each in (RLS_F, RTLS_F))
    return [
        Table(f"Samples until the median error stays below {100 * WITHIN:g} %", HEADS, rows),
        Table(f"Samples until the median error stays within {NEAR:g} times its last", HEADS, limits),
    ]


def _apart(first: Measured, second: Measured) -> Measured:
    """One less the other, with the sum of their intervals."""
    if not (math.isfinite(first.value) and math.isfinite(second.value)):
        return Measured(first.value, -math.inf, math.inf, first.runs)
    return Measured(first.value - second.value, first.low - second.high, first.high - second.low, first.runs)


def _least_squares_first(name: str) -> Check:
    return Check(
        f"samples until RLS_F is near its last error less those until RTLS_F is near its own, {name}",
        lambda outcome: _apart(to_limit(outcome, name, RLS_F), to_limit(outcome, name, RTLS_F)),
        below(0.0),
    )


def _search_later(name: str) -> Check:
    return Check(
        f"samples until below {100 * WITHIN:g} %, {COLD} less RTLS_F, {name}",
        lambda outcome: _apart(to_truth(outcome, name, COLD), to_truth(outcome, name, RTLS_F)),
        above(0.0),
    )


def _singles_later(name: str) -> Check:
    return Check(
        f"mean relative error after 500 samples, RTLS_F over RTLS1 and RTLS2, {name}",
        lambda outcome: to_singles(outcome, name, "error_500"),
        below(0.85),
    )


CLAIMS = (
    Claim(
        "convergence (8)",
        "Least squares converges first, then the fused total least squares, then the others.",
        "figures 1 to 4, no numbers",
        (*map(_least_squares_first, CASES), *map(_singles_later, CASES), *map(_search_later, CASES)),
        {
            "reproduced": "Least squares converges to a wrong value. Line searches are meant to start from nothing: those that "
            "start from least squares are below 10 % as soon as the fusion."
        },
    ),
)


def chapter() -> Chapter:
    """How fast they are; it reads the experiments of the fusion."""
    return Chapter((), CLAIMS, tables)
