"""How many samples it takes, and whether credit makes it faster."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import jax
import numpy as np

from ...networks import AbstractTraining, PerceptronTraining
from ...plants import TRACK_SCENARIOS
from ..chapter import Chapter
from ..claims import Check, Claim, above, below
from ..contender_table import cell
from ..experiment import Contender
from ..figures import Figure, Panel, Table, curve
from ..outcome import Outcome
from ..prepared import Prepared, once
from ..statistics import Measured
from .aiding import FINE, PAPERS, Recipe, beside, filtered, watched
from .comparing import errors_beside, ratio
from .contenders import DESIGN, ML
from .measures import UNITS, judged
from .noise import design, fitted
from .records import SCENARIOS, TRAINING, Drive, training_key

NAME, SCENARIO = "learning", "calibrated"
MOST = 50
SAMPLES = (300, 1000, 3000, 12_000)
EXPONENTS, FAST = (0.0, 0.5, 1.0, 1.2, 2.0), (0.5, 1.0)
RULES = (*((0.05, k) for k in EXPONENTS), *((rate, k) for rate in FAST for k in (0.0, 1.2)))
"""Rates and exponents of credit."""
STEPS = (0.002, 0.005, 0.01, 0.02, 0.05)
"""Rates of the perceptron, taught one sample after the other."""


def cmac(rate: float, exponent: float) -> str:
    """The name of a CMAC with a rule."""
    return f"CMAC, rate {rate:g}, k {exponent:g}"


def perceptron(rate: float) -> str:
    """The name of a perceptron with a rate."""
    return f"BP, rate {rate:g}"


KINDS: dict[str, AbstractTraining] = {
    **{
        cmac(rate, exponent): dataclasses.replace(FINE, rate=rate, exponent=exponent, shuffle=False, least_visits=1)
        for rate, exponent in RULES
    },
    **{perceptron(rate): PerceptronTraining(method="sgd", rate=rate, batch=1, epochs=1) for rate in STEPS},
}
CREDIT, PLAIN = cmac(0.05, 1.2), cmac(0.05, 0.0)


def after(kind: str, samples: int) -> str:
    """The name of the contender taught with so many samples."""
    return f"{kind}, {samples} samples"


TOLD = {
    after(CREDIT, 300): (0.0073, 0.0137),
    after(CREDIT, 12_000): (0.0071, 0.0147),
    after(PLAIN, 300): (None, 0.0147),
}
"""Of an independent program."""


@once
def examples() -> tuple[np.ndarray, np.ndarray]:
    """What the design filter tells a network and what that should say, of all training records in random order."""
    _, played = watched(SCENARIO, PAPERS, design())
    tables = [each[:TRAINING].reshape(-1, each.shape[-1]) for each in (played.features, played.wanted)]
    order = np.asarray(jax.random.permutation(training_key(SCENARIOS.index(SCENARIO), 29_999), len(tables[0])))
    return tables[0][order], tables[1][order]


def taught(kind: str, samples: int) -> Contender:
    """The design filter beside a network taught with so many samples, each seen once."""
    inputs, targets = (each[:samples] for each in examples())
    network, _ = KINDS[kind](inputs, targets, key=training_key(SCENARIOS.index(SCENARIO), 30_000))
    return beside(network, Recipe(KINDS[kind]), design(), least_visits=0.0)


def makers() -> dict[str, Any]:
    """Makers of all, with the filters they are compared with."""
    each = {after(kind, n): functools.partial(taught, kind, n) for kind in KINDS for n in SAMPLES}
    return {DESIGN: lambda: filtered(design()), ML: lambda: filtered(fitted(SCENARIO)), **each}


def tables(outcome: Outcome) -> list[Table]:
    """Errors after so many samples."""
    told = []
    for state, unit in UNITS.items():
        rows = tuple((kind, *(cell(outcome, NAME, after(kind, n), state) for n in SAMPLES)) for kind in KINDS)
        heads = tuple(f"{n} samples" for n in SAMPLES)
        told.append(
            Table(f"Learning: {state}, MSE [{unit}] on new records after so many samples", ("network", *heads), rows)
        )
    return [*told, errors_beside(outcome, "Learning, beside an independent program", NAME, tuple(TOLD), TOLD)]


def figures(outcome: Outcome) -> list[Figure]:
    """Learning curves of the speed."""
    x = np.asarray(SAMPLES, float)
    names = (PLAIN, CREDIT, cmac(0.5, 1.2), *map(perceptron, STEPS[1::2]))
    marks = [
        mark
        for kind in names
        for mark in curve(kind, x, [outcome.mean(NAME, after(kind, n), "speed") for n in SAMPLES])
    ]
    return [
        Figure(
            "Learning curves",
            "Speed, mean square error on new records after so many samples, each seen once, in random order.",
            (Panel("MSE", tuple(marks), "m^2/s^2", log=True),),
            "samples",
            x_log=True,
        )
    ]


def _best(samples: int) -> Check:
    """How far the best perceptron still is from what it comes to."""

    def found(outcome: Outcome) -> Measured:
        kind = min(STEPS, key=lambda rate: outcome.mean(NAME, after(perceptron(rate), SAMPLES[-1]), "speed").value)
        name = perceptron(kind)
        return outcome.ratio(NAME, "speed", after(name, samples), over=after(name, SAMPLES[-1]))

    return Check(f"MSE of speed, best perceptron, {samples} samples over {SAMPLES[-1]}", found, above(1.1))


def _over(contender: tuple[str, int], other: tuple[str, int], expected: Any) -> Check:
    return ratio("speed", NAME, after(*contender), after(*other), expected)


CLAIMS = (
    Claim(
        "learns faster (C4)",
        "The CMAC learns faster than a perceptron.",
        "in words",
        (
            # Learned: within a tenth of what it comes to.
            _over((CREDIT, 300), (CREDIT, 12_000), below(1.1)),
            _best(300),
            *(_over((CREDIT, 300), (perceptron(rate), 300), below(1.0)) for rate in STEPS),
        ),
    ),
    Claim(
        "credit (C5)",
        "Assigning credit by visits speeds learning.",
        "the reason for this kind of CMAC",
        (
            _over((CREDIT, 300), (PLAIN, 300), below(1.0)),
            _over((CREDIT, 3000), (PLAIN, 3000), below(1.0)),
            _over((cmac(0.5, 1.2), 300), (cmac(0.5, 0.0), 300), below(1.0)),
        ),
        {
            "partly": "By some per cent after the first record, and not at all later.",
            "reproduced": "By some per cent.",
            "undecided": "By some per cent after the first record; later the difference is too small to be told.",
            "not reproduced": "No difference that matters.",
        },
    ),
)


def chapter() -> Chapter:
    """One experiment with networks taught with few and many samples."""
    experiment = judged(
        NAME,
        "Networks beside the design filter, taught with so many samples",
        Drive(TRACK_SCENARIOS[SCENARIO]),
        Prepared(makers()),
        baseline=ML,
        most_runs=MOST,
    )
    return Chapter((experiment,), CLAIMS, tables, figures)
