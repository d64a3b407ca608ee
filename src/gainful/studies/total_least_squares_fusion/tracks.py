"""Estimates of single parameters over samples, the paper's figures 5 and 6, and whose is nearest the truth."""

from __future__ import annotations

import numpy as np

from ..chapter import Chapter
from ..claims import Check, Claim, above
from ..figures import Figure, Line, Panel, Table
from ..outcome import Outcome
from .comparing import closest
from .contenders import PUBLISHED, RLS_F, RTLS1, RTLS_F
from .figures import first, medians
from .fusion import CASES, EARLIEST, FIRST, HEADS, title
from .measures import AFTER
from .records import PARAMETERS, WORDS, YAW

SHOWN = {name: WORDS[name] for name in ("m", "d2")}
"""Parameters of the figures."""


def tables(outcome: Outcome) -> list[Table]:
    """How often each of the seven is nearest."""
    out = []
    for parameter, words in SHOWN.items():
        shares = [closest(outcome, name, parameter, PUBLISHED) for name in CASES]
        rows = tuple((each, *(found[each] for found in shares)) for each in PUBLISHED)
        out.append(Table(f"Share of runs in which an estimate is the nearest of seven: {words}", HEADS, rows))
    return out


def figures(outcome: Outcome) -> list[Figure]:
    """Figures 5 and 6 of the paper."""
    return [_estimates(outcome, parameter, number) for number, parameter in enumerate(SHOWN, 5)]


def _estimates(outcome: Outcome, parameter: str, number: int) -> Figure:
    column = PARAMETERS.index(parameter)
    true, unit = YAW.theta[column], YAW.units[column]
    rows = slice(int(np.searchsorted(AFTER, 3 * EARLIEST)), None)
    x = AFTER[rows]
    truth = Line("truth", x, np.full(len(x), true), reference=True)
    one = tuple(first(each, x, outcome.every(FIRST, each, "theta")[:, rows, column]) for each in PUBLISHED)
    chosen = (RLS_F, RTLS1, RTLS_F)
    spread = medians(outcome, FIRST, "theta", chosen, AFTER, rows, banded=chosen, column=column)
    return Figure(
        f"Estimates of the {SHOWN[parameter]}: figure {number} of the paper",
        f"{title(FIRST).capitalize()}: all seven in one run, and the median of the runs with the band of nine in ten. Fusion "
        "narrows the band; which estimate is nearest in one run is luck.",
        (Panel("the first run", (*one, truth), unit), Panel("median of the runs", (*spread, truth), unit)),
        "samples",
        x_log=True,
    )


def _nearest(name: str, parameter: str) -> Check:
    return Check(
        f"share of runs in which RTLS_F is nearest of seven, {parameter}, {name}",
        lambda outcome: closest(outcome, name, parameter, PUBLISHED)[RTLS_F],
        above(0.5),
    )


CLAIMS = (
    Claim(
        "closest to truth (7)",
        "The fused total least squares estimates of inertia and quadratic drag are the closest to the truth.",
        "figures 5 and 6, one run",
        tuple(_nearest(name, parameter) for parameter in SHOWN for name in CASES),
        {
            "not reproduced": "It is a matter of the run: in most of them another of the seven is nearer, by luck. What fusion "
            "lowers is the expected error."
        },
    ),
)


def chapter() -> Chapter:
    """What the paper shows of single parameters; it reads the experiments of the fusion."""
    return Chapter((), CLAIMS, tables, figures)
