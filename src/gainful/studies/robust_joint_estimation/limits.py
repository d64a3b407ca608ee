"""Where robustness against outliers of the sensors does not help: gross process noise, errors that all point one way."""

from __future__ import annotations

from typing import Any

from ..chapter import Chapter
from ..claims import Claim, above, between
from ..contender_table import compared
from ..figures import Chart, Table
from ..outcome import Outcome
from .comparing import lower, mean
from .contenders import CORRENTROPY, GATE, IRLS, NOMINAL, RA, STUDENT, TOTAL, WOLF, Belief, believing, contender
from .measures import NAMES, judged
from .records import NOISES, WALK, drive

PROCESS, QUIET, SKEWED = "process", "gaussian", "skewed"
SHARE = 0.05
COMPARED = (NOMINAL, TOTAL, RA, GATE, IRLS, STUDENT, CORRENTROPY, WOLF)


def contenders(noise: str) -> dict[str, Any]:
    """Contenders in noise of a law."""
    return {name: contender(name, believing(name, NOISES[noise], Belief(WALK))) for name in COMPARED}


def tables(outcome: Outcome) -> list[Table]:
    """Errors with gross process noise, and biases by one-sided errors."""
    process = compared(
        outcome,
        f"{100 * SHARE:g} % gross errors in the process noise, Gaussian readings: log10 MSE",
        COMPARED,
        [("states", PROCESS, "x"), ("parameters", PROCESS, "p"), ("NEES of x3", PROCESS, "nees_x3")],
    )
    errors = compared(
        outcome,
        "10 % gross errors that all point up: log10 MSE",
        COMPARED,
        [("states", SKEWED, "x"), ("parameters", SKEWED, "p")],
    )
    biases = compared(
        outcome,
        "10 % gross errors that all point up: biases, those of states in sigmas of the sensors",
        COMPARED,
        [(each, SKEWED, f"bias_{each}") for each in NAMES],
    )
    return [process, errors, biases]


def figures(outcome: Outcome) -> list[Chart]:
    """Both as charts."""
    return [
        Chart(
            "Gross process noise",
            "Squared error of the states where the sensors are Gaussian and 5 % of the process noise is ten times as large: "
            "filters that distrust readings do worse than one that does not.",
            "log10 MSE of states",
            {name: outcome.mean(PROCESS, name, "x") for name in COMPARED},
        ),
        Chart(
            "Errors that point one way",
            "Bias of the position: a robust filter bounds it, none removes it.",
            "bias in sigmas of the sensor",
            {name: outcome.mean(SKEWED, name, "bias_x1") for name in COMPARED},
        ),
    ]


CLAIMS = (
    Claim(
        "gross process noise",
        "Filters that are robust against their sensors lose to the plain one where it is the process noise that has outliers.",
        "not in the paper",
        tuple(
            lower("x", PROCESS, NOMINAL, name, by=0.1, where="gross process noise")
            for name in (RA, CORRENTROPY, STUDENT)
        ),
        {"reproduced": "What is far off is taken for a bad reading; the state has moved."},
    ),
    Claim(
        "one-sided errors",
        "The robust filter bounds the bias that one-sided gross errors make, but has one.",
        "not in the paper",
        (
            mean("bias of the position in sigmas, RA", SKEWED, RA, "bias_x1", between(0.05, 0.4)),
            mean("the same, extended filter", SKEWED, NOMINAL, "bias_x1", above(0.8)),
        ),
    ),
)


def chapter() -> Chapter:
    """What the model of a filter robust against its sensors leaves out."""
    experiments = (
        judged(
            PROCESS,
            "Gross process noise",
            drive(NOISES[QUIET], walk=WALK, process=SHARE),
            contenders(QUIET),
            baseline=NOMINAL,
        ),
        judged(SKEWED, "One-sided gross errors", drive(NOISES[SKEWED], walk=WALK), contenders(SKEWED), baseline=TOTAL),
    )
    return Chapter(experiments, CLAIMS, tables, figures)
