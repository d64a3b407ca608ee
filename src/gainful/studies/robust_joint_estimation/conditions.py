"""Other conditions than the paper's: fewer sensors, the full nonlinear axis, a wrong start."""

from __future__ import annotations

import dataclasses
from typing import Any

from ..chapter import Chapter
from ..claims import Check, Claim, above, below, between
from ..contender_table import compared
from ..figures import Chart, Table
from ..outcome import Outcome
from .comparing import lower, mean, share
from .contenders import (
    CORRENTROPY,
    DETECTOR,
    GATE,
    IRLS,
    NOMINAL,
    RA,
    SCHOOLS,
    STUDENT,
    TOTAL,
    Belief,
    believing,
    contender,
)
from .measures import judged
from .records import NOISES, WALK, drive

LAW = NOISES["mixture"]
SETS = {
    "position": ((True, False, False), "position alone"),
    "position-pressure": ((True, False, True), "position and load pressure"),
}
"""Sensors by the name of the experiment: which of the three there are."""
FEWER = (NOMINAL, TOTAL, RA, GATE, STUDENT, CORRENTROPY)

FULL = {"constant": "full-constant", "abrupt": "full-abrupt"}
"""Experiments on the full axis by track."""
WIDE = (1e-3, 1e-2, 5e-2)
"""Process noise that makes room for what the reduced model leaves out, per sample."""
ON_FULL = (NOMINAL, TOTAL, RA, DETECTOR)
NARROW_Q, WIDE_Q = ", Q of the reduced axis", ", Q wider"

STARTUP = "start-up"
WRONG = (0.0, 0.0, 0.0, 0.3, 2.5)


def made(names: tuple[str, ...], belief: Belief, suffix: str = "") -> dict[str, Any]:
    """Contenders with a belief."""
    return {name + suffix: contender(name, believing(name, LAW, belief)) for name in names}


def on_full() -> dict[str, Any]:
    """Contenders on the full axis: its valve is asymmetric, and they know."""
    reduced = dataclasses.replace(Belief(WALK), asymmetric=True)
    return made(ON_FULL, dataclasses.replace(reduced, process_sigmas=WIDE), WIDE_Q) | made(ON_FULL, reduced, NARROW_Q)


def tables(outcome: Outcome) -> list[Table]:
    """Fewer sensors, the full axis, the wrong start."""
    fewer = compared(
        outcome,
        "Fewer sensors, 10 % gross errors: log10 MSE",
        FEWER,
        [
            (f"{word}, {title}", each, what)
            for each, (_, title) in SETS.items()
            for what, word in (("x", "states"), ("p", "parameters"))
        ],
    )
    still, jumping = FULL.values()
    constant = compared(
        outcome,
        "The full nonlinear axis, constant parameters, 10 % gross errors: log10 MSE, biases, alarms per record",
        list(on_full()),
        [
            ("states", still, "x"),
            ("parameters", still, "p"),
            ("bias of p1", still, "bias_p1"),
            ("bias of p2", still, "bias_p2"),
            ("alarms", still, "alarms"),
        ],
    )
    jumps = compared(
        outcome,
        "The full nonlinear axis, jumps, 10 % gross errors: log10 MSE, alarms per record",
        list(on_full()),
        [
            ("states", jumping, "x"),
            ("parameters", jumping, "p"),
            ("alarms", jumping, "alarms"),
            ("wrong ones", jumping, "wrong"),
        ],
    )
    start = compared(
        outcome,
        "Start from parameters of 0.3 and 2.5 where both are 1, position alone, 10 % gross errors",
        SCHOOLS,
        [
            ("converged", STARTUP, "converged"),
            ("states, log10 MSE", STARTUP, "x"),
            ("parameters, log10 MSE", STARTUP, "p"),
        ],
    )
    return [fewer, constant, jumps, start]


def figures(outcome: Outcome) -> list[Chart]:
    """The wrong start as a chart."""
    return [
        Chart(
            "Start-up from wrong parameters",
            "Share of records in which, over the last half second, the mean absolute error of p1 is below 0.15 and that of p2 "
            "below 0.06.",
            "share converged",
            {name: outcome.share(STARTUP, name, "converged") for name in SCHOOLS},
        )
    ]


def _more_often(other: str) -> Check:
    return Check(
        f"share converged, RA less {other}",
        lambda outcome: outcome.difference(STARTUP, "converged", RA, minus=other),
        above(0.0),
    )


CLAIMS = (
    Claim(
        "fewer sensors",
        "The advantage over an extended filter told the total variance holds with the position alone.",
        "not in the paper",
        (
            lower("x", "position", RA, TOTAL, by=0.1, where="position alone"),
            lower("x", "position-pressure", RA, TOTAL, by=0.1, where="position and load pressure"),
        ),
    ),
    Claim(
        "full axis",
        "On the full axis the robust filter keeps its advantage, if its Q makes room for what the model leaves out.",
        "not in the paper, whose plant is the model",
        (
            lower("x", FULL["constant"], RA + WIDE_Q, TOTAL + WIDE_Q, by=0.2, where="full axis"),
            mean("bias of p1", FULL["constant"], RA + WIDE_Q, "bias_p1", between(-0.06, 0.06)),
            mean("bias of p1, Q of the reduced axis", FULL["constant"], RA + NARROW_Q, "bias_p1", below(-0.06)),
            lower("p", FULL["abrupt"], DETECTOR + WIDE_Q, RA + WIDE_Q, by=0.5, where="full axis, jumps"),
            mean("wrong alarms, jumps", FULL["abrupt"], DETECTOR + WIDE_Q, "wrong", below(0.2)),
            mean("false alarms", FULL["constant"], DETECTOR + WIDE_Q, "alarms", below(0.2)),
            mean("false alarms, Q of the reduced axis", FULL["constant"], DETECTOR + NARROW_Q, "alarms", above(0.5)),
        ),
        {"reproduced": "With a Q that leaves no room for the model's own error that error is taken for a fault."},
    ),
    Claim(
        "wrong start",
        "From wrong parameters and with the position alone the robust filter converges where others often do not.",
        "not in the paper",
        (
            share("converged, RA", STARTUP, RA, "converged", above(0.7)),
            *(_more_often(other) for other in (TOTAL, NOMINAL, IRLS, STUDENT)),
        ),
    ),
)


def chapter() -> Chapter:
    """What is left of it elsewhere than in the paper's setting."""
    sensors = tuple(
        judged(
            name,
            f"Sensors: {title}",
            drive(LAW, walk=WALK, sensors=seen),
            made(FEWER, Belief(WALK)),
            baseline=TOTAL,
        )
        for name, (seen, title) in SETS.items()
    )
    full = tuple(
        judged(
            name,
            f"The full axis, {kind} parameters",
            drive(LAW, kind, plant="full"),
            on_full(),
            baseline=TOTAL + WIDE_Q,
        )
        for kind, name in FULL.items()
    )
    start = judged(
        STARTUP,
        "A wrong start, position alone",
        drive(LAW, sensors=(True, False, False)),
        made(SCHOOLS, dataclasses.replace(Belief(WALK), start=WRONG)),
        baseline=TOTAL,
    )
    return Chapter((*sensors, *full, start), CLAIMS, tables, figures)
