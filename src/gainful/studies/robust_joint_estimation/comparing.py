"""Checks that the chapters' claims are made of."""

from __future__ import annotations

from collections.abc import Callable

from ..claims import Check, Tolerance, below
from ..outcome import Outcome
from ..statistics import Measured, difference_interval

WORDS = {"x": "states", "p": "parameters"}


def lower(what: str, experiment: str, contender: str, than: str, *, by: float = 0.0, where: str = "") -> Check:
    """That a contender's log10 MSE of the states ("x") or parameters ("p") is lower than another's on the same records.

    Args:
        what: "x" or "p".
        experiment: by name.
        contender: whose should be lower.
        than: whose should be higher.
        by: at least how much.
        where: the experiment in words; its name by default.
    """
    return Check(
        f"log10 MSE of {WORDS[what]}, {contender} less {than}, {where or experiment}",
        lambda outcome: outcome.difference(experiment, what, contender, minus=than),
        below(0.0 - by),
    )


def across(
    what: str, contender: str, experiment: str, minus: str, expected: Tolerance, *, where: str, quantity: str = "x"
) -> Check:
    """How much a contender's number differs between two experiments with the same random numbers.

    Args:
        what: is compared, in words.
        contender: by name.
        experiment: whose number is taken.
        minus: whose number is taken off.
        expected: of the difference.
        where: the two experiments in words.
        quantity: by name.
    """

    def found(outcome: Outcome) -> Measured:
        first, second = (outcome.values(name, contender, quantity) for name in (experiment, minus))
        return difference_interval(first, second)

    return Check(f"{what}, {contender}, {where}", found, expected)


def mean(what: str, experiment: str, contender: str, quantity: str, expected: Tolerance) -> Check:
    """The mean of a quantity."""
    return Check(what, _of("mean", experiment, contender, quantity), expected)


def median(what: str, experiment: str, contender: str, quantity: str, expected: Tolerance) -> Check:
    """The median of a quantity."""
    return Check(what, _of("median", experiment, contender, quantity), expected)


def share(what: str, experiment: str, contender: str, quantity: str, expected: Tolerance) -> Check:
    """The share of runs in which something happened."""
    return Check(what, _of("share", experiment, contender, quantity), expected)


def _of(statistic: str, experiment: str, contender: str, quantity: str) -> Callable[[Outcome], Measured]:
    return lambda outcome: getattr(outcome, statistic)(experiment, contender, quantity)
