"""Numbers and checks that the chapters' claims are made of."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..claims import Check, Tolerance
from ..outcome import Outcome
from ..statistics import Measured, ratio_interval, share_interval
from .records import PARAMETERS


def ratio(
    experiment: str,
    contender: str,
    over: str,
    expected: Tolerance,
    *,
    quantity: str = "error",
    what: str = "mean relative error",
) -> Check:
    """The mean of a quantity over that of another contender, on the same records."""
    return Check(
        f"{what}, {contender} over {over}, {experiment}",
        lambda outcome: outcome.ratio(experiment, quantity, contender, over=over),
        expected,
    )


def rms_ratio(outcome: Outcome, experiment: str, quantity: str, contender: str, over: str) -> Measured:
    """The root mean square of one contender's errors over that of another's, on the same records."""
    squares = (outcome.values(experiment, name, quantity) ** 2 for name in (contender, over))
    found = ratio_interval(*squares)
    value, low, high = (math.sqrt(each) if each >= 0 else each for each in (found.value, found.low, found.high))
    return Measured(value, low, high, found.runs, found.unit, found.note)


def nearer(
    experiment: str, contender: str, others: tuple[str, ...], expected: Tolerance, *, quantity: str = "error"
) -> Check:
    """The share of runs in which a contender's error is smaller than those of all others."""

    def share(outcome: Outcome) -> Measured:
        errors = [outcome.values(experiment, name, quantity) for name in (contender, *others)]
        return share_interval(errors[0] < np.min(errors[1:], axis=0))

    when = quantity.replace("error_", " after ") + " samples" if quantity != "error" else ""
    than = " and ".join(others)
    return Check(f"share of runs in which {contender} is nearer than {than}{when}, {experiment}", share, expected)


def closest(outcome: Outcome, experiment: str, parameter: str, names: tuple[str, ...]) -> dict[str, Measured]:
    """By contender, the share of runs in which its estimate of a parameter is nearer the truth than those of the others."""
    off = np.abs([outcome.values(experiment, name, parameter) for name in names])
    nearest = np.argmin(np.nan_to_num(off, nan=np.inf), axis=0)
    return {name: share_interval(nearest == k) for k, name in enumerate(names)}


def worst_of(measure: Callable[[Outcome, str], Measured]) -> Callable[[Outcome], Measured]:
    """Of a number per parameter the one that is farthest from zero with its interval."""

    def worst(outcome: Outcome) -> Measured:
        return max((measure(outcome, name) for name in PARAMETERS), key=_reach)

    return worst


def _reach(found: Measured) -> float:
    return max(abs(found.low), abs(found.high), abs(found.value)) if found.known else math.inf


def scaled(found: Measured, by: float, unit: str = "1", shift: float = 0.0) -> Measured:
    """`by (found + shift)`, for a factor above zero."""
    value, low, high = (by * (each + shift) for each in (found.value, found.low, found.high))
    return Measured(value, low, high, found.runs, unit, found.note)
