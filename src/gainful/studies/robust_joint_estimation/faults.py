"""Parameters that jump, drift and come and go: what a fault costs the filters, and what a detector gives back."""

from __future__ import annotations

from typing import Any

from ..chapter import Chapter
from ..claims import Claim, below
from ..contender_table import compared
from ..figures import Band, Figure, Line, Panel, Table
from ..outcome import Outcome
from .comparing import lower, mean, median
from .contenders import (
    CORRENTROPY,
    DETECTOR,
    EXPECTATION,
    GATE,
    IRLS,
    NOMINAL,
    RA,
    STUDENT,
    TOTAL,
    TUNED,
    WOLF,
    Belief,
    believing,
    contender,
)
from .figures import PARAMETERS, errors_over_time
from .measures import judged
from .records import NOISES, TRACKS, WALK, drive

SLOW, FAST = WALK, 0.01
LAWS = {"mixture": "10 % gross errors", "gaussian": "Gaussian noise"}


def walking(name: str, walk: float) -> str:
    """A contender's name."""
    return f"{name}, q = {walk:g}"


CHOSEN = {
    walking(name, walk): (name, walk)
    for name in (NOMINAL, TOTAL, RA, EXPECTATION, DETECTOR, GATE, IRLS, STUDENT, CORRENTROPY, WOLF)
    for walk in sorted({SLOW, FAST, TUNED[name]})
}
"""Filters by name: each with the walk of slow parameters, with a faster one, and tuned."""
SLOW_RA, FAST_RA, ALARMED = walking(RA, SLOW), walking(RA, FAST), walking(DETECTOR, SLOW)
SLOW_EKF, FAIR = walking(NOMINAL, SLOW), walking(TOTAL, TUNED[TOTAL])
SLOW_CORRENTROPY = walking(CORRENTROPY, SLOW)


def named(kind: str, noise: str) -> str:
    """An experiment's name."""
    return f"{kind}-{noise}"


def contenders(noise: str) -> dict[str, Any]:
    """All contenders in noise of a law."""
    return {
        each: contender(name, believing(name, NOISES[noise], Belief(walk))) for each, (name, walk) in CHOSEN.items()
    }


def tables(outcome: Outcome) -> list[Table]:
    """Jumps in both kinds of noise, the other faults, and alarms."""
    quantities = {"states": "x", "parameters": "p", "p1 [ms]": "settling_p1", "p2 [ms]": "settling_p2"}
    titles = {
        "mixture": "Jumps, 10 % gross errors: log10 MSE, and the time until p1 is within 15 % and p2 within 10 % for 20 ms",
        "gaussian": "Jumps, Gaussian noise: log10 MSE and times",
    }
    jumps = [
        compared(
            outcome, title, list(CHOSEN), [(head, named("abrupt", noise), what) for head, what in quantities.items()]
        )
        for noise, title in titles.items()
    ]
    others = [
        compared(
            outcome,
            f"Other faults, 10 % gross errors: log10 MSE of the {word}",
            list(CHOSEN),
            [(kind, named(kind, "mixture"), what) for kind in TRACKS if kind != "abrupt"],
        )
        for what, word in (("x", "states"), ("p", "parameters"))
    ]
    told = ("alarms", "wrong", "score_mean", "score_variance", "delay_p1", "delay_p2")
    rows = tuple(
        (
            f"{kind}, {title}",
            *(
                None
                if what.startswith("delay") and kind != "abrupt"
                else outcome.summary(named(kind, noise), ALARMED, what)
                for what in told
            ),
        )
        for noise, title in LAWS.items()
        for kind in TRACKS
    )
    alarms = Table(
        f"Alarms of {ALARMED}, per record; those of a parameter that did not change within 0.1 s are wrong",
        ("records", "alarms", "wrong", "mean score", "its variance", "p1 [ms]", "p2 [ms]"),
        rows,
    )
    return [*jumps, *others, alarms]


def figures(outcome: Outcome) -> list[Figure]:
    """One record with jumps, and the errors over time."""
    experiment = named("abrupt", "mixture")
    record = outcome.record(experiment)
    t, truth = record.truth["t"], record.truth["parameters"]
    panels = []
    for j, label in enumerate(PARAMETERS):
        marks: list[Line | Band] = [
            Line(name, t, outcome.trace(experiment, name, "parameters").first[:, j])
            for name in (ALARMED, SLOW_RA, FAST_RA, FAIR)
        ]
        panels.append(Panel(label, (*marks, Line("truth", t, truth[:, j], reference=True))))
    shown = (ALARMED, SLOW_RA, FAST_RA, SLOW_EKF, FAIR, SLOW_CORRENTROPY)
    return [
        Figure(
            "Jumps of both parameters",
            "The first record, 10 % gross errors. What q a filter assumes decides whether it follows; a detector does not "
            "have to choose.",
            tuple(panels),
            telling=True,
        ),
        errors_over_time(outcome, experiment, "Squared errors, jumps, 10 % gross errors", shown),
        errors_over_time(outcome, named("intermittent", "mixture"), "Squared errors, faults that come and go", shown),
    ]


JUMPS, CLEAN = named("abrupt", "mixture"), named("abrupt", "gaussian")
CLAIMS = (
    Claim(
        "sensitive to faults (C5)",
        "The robust filter keeps its sensitivity to all faults of parameters, and is superior when they occur.",
        "in words",
        (
            lower("p", JUMPS, SLOW_RA, SLOW_EKF, by=0.03),
            lower("x", CLEAN, SLOW_RA, SLOW_EKF),
            lower("p", JUMPS, FAST_RA, FAIR),
            lower("x", JUMPS, FAST_RA, FAIR),
        ),
        {
            "partly": "With the walk of slow parameters it takes a jump for outliers; it is superior once its q is tuned to "
            "the fault, which costs accuracy as long as there is none, or with a detector of changes."
        },
    ),
    Claim(
        "the price of tuning",
        "A q tuned to faults costs nothing while there is none.",
        "not in the paper",
        (lower("p", named("constant", "mixture"), FAST_RA, SLOW_RA, by=-0.1),),
        {"not reproduced": "The squared error of the parameters is about three times as large."},
    ),
    Claim(
        "detector",
        "With a detector of changes on its score the robust filter follows jumps at once, whatever its q.",
        "not in the paper",
        (
            median("p1 settles [ms]", JUMPS, ALARMED, "settling_p1", below(30.0)),
            median("p2 settles [ms]", JUMPS, ALARMED, "settling_p2", below(30.0)),
            mean("log10 MSE of parameters", JUMPS, ALARMED, "p", below(-1.8)),
            lower("p", JUMPS, ALARMED, FAST_RA, by=0.2),
            lower("p", named("intermittent", "mixture"), ALARMED, FAST_RA),
            mean("wrong alarms per record", JUMPS, ALARMED, "wrong", below(0.3)),
            mean("alarms per record without a fault", named("constant", "mixture"), ALARMED, "alarms", below(0.3)),
        ),
    ),
    Claim(
        "which covariance",
        "After a jump the indicator form of the covariance recovers faster than its expectation.",
        "not in the paper, which has the indicator",
        (
            lower("x", JUMPS, SLOW_RA, walking(EXPECTATION, SLOW)),
            lower("p", JUMPS, FAST_RA, walking(EXPECTATION, FAST)),
            lower("p", JUMPS, FAST_RA, walking(EXPECTATION, TUNED[EXPECTATION])),
        ),
        {
            "partly": "At the same q it does, since the expectation goes on shrinking the covariance while the innovations are "
            "clipped. Tuned, the expectation has twice the q and follows a jump sooner, at the price of twice the squared "
            "error of the parameters while they stand still."
        },
    ),
)


def chapter() -> Chapter:
    """What happens when the parameters do not just walk."""
    experiments = tuple(
        judged(
            named(kind, noise),
            f"{kind[0].upper()}{kind[1:]} parameters, {title}",
            drive(NOISES[noise], kind),
            contenders(noise),
            baseline=FAIR,
        )
        for noise, title in LAWS.items()
        for kind in TRACKS
    )
    return Chapter(experiments, CLAIMS, tables, figures)
