"""How many gross errors there are, how many a filter expects, and what variance it believes the others have."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ..chapter import Chapter
from ..claims import Claim
from ..contender_table import compared
from ..figures import Chart, Figure, Panel, Table, curve
from ..outcome import Outcome
from .comparing import WORDS, lower
from .contenders import CORRENTROPY, NOMINAL, RA, STUDENT, TOLD, TOTAL, Belief, believing, contender
from .measures import judged
from .records import NOISES, WALK, drive, mixture

SHARES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4)
KNOWING = "RA, k of the true share"
SCALES = (0.1, 0.25, 1.0, 4.0, 10.0)
SCALED = (NOMINAL, RA, STUDENT, CORRENTROPY)
MISJUDGED = "misjudged"


def swept(share: float) -> str:
    """An experiment's name."""
    return f"share-{share:g}"


def scaled(name: str, factor: float) -> str:
    """A contender's name."""
    return f"{name}, R x {factor:g}"


def expecting(share: float) -> dict[str, Any]:
    """Contenders on records with a share of gross errors."""
    law, walks = mixture(share), Belief(WALK)
    return {
        **{
            name: contender(name, believing(name, law, walks))
            for name in (NOMINAL, TOTAL, RA, STUDENT, CORRENTROPY, TOLD)
        },
        KNOWING: contender(RA, walks, contamination=share),
    }


def misjudging() -> dict[str, Any]:
    """Contenders that believe the readings to be better or worse than they are."""
    return {
        scaled(name, factor): contender(name, dataclasses.replace(Belief(WALK), scale=factor))
        for name in SCALED
        for factor in SCALES
    }


def tables(outcome: Outcome) -> list[Table]:
    """Errors over the share of gross errors, and over the variance believed."""
    shares = [
        compared(
            outcome,
            f"Share of gross errors: log10 MSE of the {word}",
            list(expecting(SHARES[0])),
            [(f"{100 * share:g} %", swept(share), what) for share in SHARES],
        )
        for what, word in WORDS.items()
    ]
    scales = [
        Table(
            f"R believed over R nominal, 10 % gross errors: log10 MSE of the {word}",
            ("filter", *(f"{factor:g}" for factor in SCALES)),
            tuple(
                (name, *(outcome.mean(MISJUDGED, scaled(name, factor), what) for factor in SCALES)) for name in SCALED
            ),
        )
        for what, word in WORDS.items()
    ]
    return [*shares, *scales]


def figures(outcome: Outcome) -> list[Figure | Chart]:
    """The same as curves."""
    shares, scales = np.array(SHARES), np.array(SCALES)
    labels = {"x": "states, log10 MSE", "p": "parameters, log10 MSE"}

    def over_shares(what: str) -> Panel:
        marks = [
            mark
            for name in expecting(SHARES[0])
            for mark in curve(name, shares, [outcome.mean(swept(share), name, what) for share in SHARES])
        ]
        return Panel(labels[what], tuple(marks))

    def over_scales(what: str) -> Panel:
        marks = [
            mark
            for name in SCALED
            for mark in curve(name, scales, [outcome.mean(MISJUDGED, scaled(name, factor), what) for factor in SCALES])
        ]
        return Panel(labels[what], tuple(marks))

    return [
        Figure(
            "More gross errors than expected",
            "Errors over the share of gross errors; all robust filters but one expect 10 %.",
            (over_shares("x"), over_shares("p")),
            "share of gross errors",
            telling=True,
        ),
        Figure(
            "A wrong R",
            "Errors over the factor by which the variance of the readings is misjudged, 10 % gross errors.",
            (over_scales("x"), over_scales("p")),
            "R believed over R nominal",
            x_log=True,
        ),
    ]


CLAIMS = (
    Claim(
        "up to 40 % gross errors",
        "The robust filter withstands far more gross errors than it expects.",
        "in words (C4)",
        (
            lower("x", swept(0.4), RA, TOTAL, by=0.1, where="40 % gross errors"),
            lower("x", swept(0.2), RA, TOTAL, by=0.1, where="20 % gross errors"),
        ),
    ),
    Claim(
        "knowing the share",
        "To know the share of gross errors is worth more than a tenth of the squared error.",
        "not in the paper",
        tuple(
            lower("x", swept(share), KNOWING, RA, by=0.05, where=f"{100 * share:g} % gross errors")
            for share in (0.05, 0.2, 0.4)
        ),
        {
            "not reproduced": "The threshold hardly matters.",
            "partly": "It is where there are many.",
        },
    ),
    Claim(
        "a wrong R",
        "The robust filter is little sensitive to a wrong R, up to a tenth and four times the true one.",
        "not in the paper",
        (
            lower("x", MISJUDGED, scaled(RA, 0.1), scaled(RA, 1.0), by=-0.15),
            lower("x", MISJUDGED, scaled(RA, 4.0), scaled(RA, 1.0), by=-0.15),
        ),
    ),
)


def chapter() -> Chapter:
    """More gross errors than expected, or sensors that are better or worse."""
    experiments = tuple(
        judged(
            swept(share),
            f"{100 * share:g} % gross errors",
            drive(mixture(share), walk=WALK),
            expecting(share),
            baseline=TOTAL,
        )
        for share in SHARES
    )
    wrong = judged(MISJUDGED, "A wrong R", drive(NOISES["mixture"], walk=WALK), misjudging())
    return Chapter((*experiments, wrong), CLAIMS, tables, figures)
