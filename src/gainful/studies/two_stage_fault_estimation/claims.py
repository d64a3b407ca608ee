"""What the paper claims, and the numbers that bear it out or do not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...faults import time_to_reach
from ..claims import Check, Claim, above, below, between
from ..outcome import Outcome
from ..statistics import Measured, exactly, share_interval
from .contenders import GATED, GATED_BIAS, LITERAL, PUBLISHED, TUNED
from .scenarios import END, GYRO, LOSS, OFFSET, ONSET, SCENARIOS, Scenario

SCALE_OF_PLOTS = 0.01
"""A curve within this share of the axis cannot be told from another."""


def time_to_follow(outcome: Outcome, scenario: Scenario, contender: str) -> Measured:
    """Time from the onset until the mean estimate over runs reaches 90 % of the fault [s]."""
    t, mean = outcome.record(scenario.name).truth["t"], outcome.trace(scenario.name, contender, "fault").mean
    taken = float(time_to_reach(t, mean, scenario.size, ONSET, until=END))
    return exactly(np.inf if np.isnan(taken) else taken, "s")


def missed(outcome: Outcome, scenario: Scenario, contender: str, quantity: str) -> Measured:
    """Share of runs in which a statistic does not rise, within 10 s of the fault, above all it reached before any fault.

    The threshold is the largest value of all runs before the onset: less than one false alarm in the time they last together.
    """
    before = outcome.values(scenario.name, contender, f"{quantity}_before")
    after = outcome.values(scenario.name, contender, f"{quantity}_after")
    return share_interval(after <= before.max())


def _ratio(scenario: Scenario, quantity: str, contender: str, over: str) -> Callable[[Outcome], Measured]:
    return lambda outcome: outcome.ratio(scenario.name, quantity, contender, over=over)


def _follow(scenario: Scenario, contender: str) -> Callable[[Outcome], Measured]:
    return lambda outcome: time_to_follow(outcome, scenario, contender)


def _missed(scenario: Scenario, contender: str, quantity: str) -> Callable[[Outcome], Measured]:
    return lambda outcome: missed(outcome, scenario, contender, quantity)


def _mean(scenario: Scenario, contender: str, quantity: str) -> Callable[[Outcome], Measured]:
    return lambda outcome: outcome.mean(scenario.name, contender, quantity)


def _median(scenario: Scenario, contender: str, quantity: str) -> Callable[[Outcome], Measured]:
    return lambda outcome: outcome.median(scenario.name, contender, quantity)


def _apart(outcome: Outcome) -> Measured:
    """Greatest difference of two filters' rate estimates over the range of the rate in the figure."""
    rates = [outcome.trace(OFFSET.name, name, "rate").first for name in (PUBLISHED, GATED)]
    return exactly(float(np.abs(rates[0] - rates[1]).max() / np.ptp(rates[0])))


CLAIMS = (
    Claim(
        "fast",
        "With a small Q of the faults the TSUKF follows a jump too slowly; the adaptive filter follows it fast.",
        "figures 1 to 3, no numbers",
        tuple(
            check
            for each in SCENARIOS
            for check in (
                Check(f"RMSE, gated over published, {each.name}", _ratio(each, "rmse", GATED, PUBLISHED), below(0.9)),
                Check(f"time to 90 %, gated, {each.name} [s]", _follow(each, GATED), below(5.0)),
            )
        ),
        {"reproduced": "The adaptation must be gated and bounded; read literally it is worse for the loss, see below."},
    ),
    Claim(
        "fast, read literally",
        "The same with the scale matrices in the published order (R, states, faults), plain pseudo-inverses and no gate.",
        "section 3",
        tuple(
            Check(f"RMSE, literal over published, {each.name}", _ratio(each, "rmse", LITERAL, PUBLISHED), below(0.9))
            for each in SCENARIOS
        ),
        {
            "partly": "Where the command passes through zero the loss has no effect on the innovations, and an unbounded "
            "inverse makes anything of it."
        },
    ),
    Claim(
        "no tuning",
        "Adaptation spares tuning: the ATSUKF is better than the TSUKF.",
        "conclusion",
        tuple(
            check
            for each in SCENARIOS
            for check in (
                Check(f"RMSE, gated over tuned, {each.name}", _ratio(each, "rmse", GATED, TUNED), below(1.0)),
                Check(f"steady RMSE, gated over tuned, {each.name}", _ratio(each, "steady", GATED, TUNED), below(0.5)),
            )
        ),
        {"partly": "Against a tuned filter the gain is in the steady error, not in the error over all."},
    ),
    Claim(
        "jumps of the factor",
        "The factor jumps from 1 to 1e13 when the fault comes and goes, and is 1 elsewhere.",
        "figures 1c to 3c",
        (
            *(
                Check(f"largest factor, log10, {each.name}", _mean(each, GATED, "factor"), above(6.0))
                for each in SCENARIOS
            ),
            Check("fault-free steps with a factor above 1, gated", _mean(OFFSET, GATED, "restless"), below(0.01)),
            Check("fault-free steps with a factor above 1, literal", _mean(OFFSET, LITERAL, "restless"), below(0.01)),
        ),
        {
            "partly": "It jumps by many decades; it is 1 elsewhere only with a gate, or with an R too large for the sensors."
        },
    ),
    Claim(
        "late for losses",
        "A loss of effectiveness is found late, since the command is about zero when it comes.",
        "section 4",
        (
            Check("first factor above 1, offset [s]", _median(OFFSET, GATED, "first"), below(1.0)),
            Check("first factor above 1, loss [s]", _median(LOSS, GATED, "first"), between(1.0, 5.0)),
            Check("first factor above 1, gyro [s]", _median(GYRO, GATED, "first"), below(1.0)),
        ),
    ),
    Claim(
        "factor as detector",
        "The jump of the factor can itself be used to detect faults.",
        "section 4",
        tuple(
            Check(f"faults missed by the literal factor, {each.name}", _missed(each, LITERAL, "factor"), below(0.05))
            for each in SCENARIOS
        )
        + tuple(
            Check(f"faults missed by the windowed NIS, {each.name}", _missed(each, GATED_BIAS, "window"), below(0.2))
            for each in SCENARIOS
        ),
        {"partly": "The ungated factor is as large without a fault; the statistic of the gate finds them all."},
    ),
    Claim(
        "states alike",
        "The state estimates of TSUKF and ATSUKF hardly differ.",
        "figures 1a and 1b to 3a and 3b",
        (
            Check("apart in the figure of the x rate, in units of its range", _apart, below(SCALE_OF_PLOTS)),
            Check(
                "x rate RMSE, gated over published, offset",
                _ratio(OFFSET, "rate", GATED, PUBLISHED),
                between(0.8, 1.25),
            ),
            Check(
                "x angle RMSE, gated over published, gyro", _ratio(GYRO, "angle", GATED, PUBLISHED), between(0.8, 1.25)
            ),
        ),
        {"partly": "They look alike at the scale of the figures; the errors differ many times over."},
    ),
)
