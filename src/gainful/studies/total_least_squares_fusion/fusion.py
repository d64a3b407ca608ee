"""The paper's experiments: yaw and surge, noise of variance 0.1 and 0.2 in every column; its figures 1 to 4."""

from __future__ import annotations

import numpy as np

from ..chapter import Chapter
from ..claims import Check, Claim, above, below, between
from ..figures import Figure, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured, ratio_interval
from .comparing import nearer, ratio
from .contenders import (
    COLD,
    CROSS,
    FRTLS,
    MEAN_RLS,
    MEAN_RTLS,
    PUBLISHED,
    RLS1,
    RLS2,
    RLS_F,
    RTLS1,
    RTLS2,
    RTLS_F,
    everybody,
)
from .figures import first, medians
from .measures import AFTER, judged
from .records import SURGE, YAW, Axis, noisy_rows

VARIANCES = (0.1, 0.2)
EARLIEST = 25
"""Samples from which figures begin; before, estimates are all over the place."""
LATE = 1000
"""Samples from which the inset begins."""


def named(axis: Axis, variance: float) -> str:
    """An experiment's name."""
    return f"{axis.name}-{variance:g}"


CASES = {named(axis, variance): (axis, variance) for axis in (YAW, SURGE) for variance in VARIANCES}
"""The paper's four experiments by name."""


FIRST = named(YAW, 0.1)
"""The experiment of which estimates are shown, not their errors alone."""


def title(name: str) -> str:
    """An experiment in words."""
    axis, variance = CASES[name]
    return f"{axis.name}, variance {variance:g}"


HEADS = ("Contender", *(title(name).capitalize() for name in CASES))
"""Headings of tables of contenders by experiments."""


def tables(outcome: Outcome) -> list[Table]:
    """Errors at the end, and how many records are lost."""
    errors = outcome.compared("Relative error after 2000 samples, mean over runs", "error", CASES)
    rows = tuple(
        (name, *(outcome.share(case, name, "lost") for case in CASES)) for name in (RTLS1, RTLS_F, FRTLS, COLD)
    )
    lost = Table("Share of runs with a relative error above 1 at the end", HEADS, rows)
    return [errors, lost]


def figures(outcome: Outcome) -> list[Figure]:
    """Errors over samples: one run as in the paper, all runs, and the late part of both."""
    return [each for number, name in enumerate(CASES, 1) for each in _errors(outcome, name, number)]


def _errors(outcome: Outcome, name: str, number: int) -> list[Figure]:
    begin, late = (slice(int(np.searchsorted(AFTER, k)), None) for k in (EARLIEST, LATE))
    heading = f"Errors over samples, {title(name)}: figure {number} of the paper"

    def panels(rows: slice) -> tuple[Panel, Panel]:
        runs = {each: outcome.every(name, each, "error")[:, rows] for each in PUBLISHED}
        one = tuple(first(each, AFTER[rows], values) for each, values in runs.items())
        banded = (RLS_F, RTLS_F)
        return (
            Panel("relative error, the first run", one, log=True),
            Panel(
                "relative error, median of the runs",
                medians(outcome, name, "error", PUBLISHED, AFTER, rows, banded=banded),
                log=True,
            ),
        )

    return [
        Figure(
            heading,
            "The distance of the estimate from the truth over the size of the truth: in one run as the paper shows it, where "
            "chance decides who is ahead, and over all runs. FRTLS is least squares for its first 100 samples.",
            panels(begin),
            "samples",
            x_log=True,
        ),
        Figure(heading, "The late part of the same, the inset of the paper.", panels(late), "samples"),
    ]


def to_singles(outcome: Outcome, experiment: str, quantity: str = "error") -> Measured:
    """The mean error of the fusion over that of the two sensors alone."""
    fused, one, two = (outcome.values(experiment, name, quantity) for name in (RTLS_F, RTLS1, RTLS2))
    return ratio_interval(fused, 0.5 * (one + two))


def _singles(name: str) -> Check:
    return Check(
        f"mean relative error, RTLS_F over RTLS1 and RTLS2, {name}",
        lambda outcome: to_singles(outcome, name),
        below(0.85),
    )


def _lost(name: str) -> Check:
    return Check(f"share of runs lost, {name}", lambda outcome: outcome.share(name, COLD, "lost"), below(0.001))


CLAIMS = (
    Claim(
        "LS fusion (2)",
        "The least squares methods have the largest errors, which nearly coincide: fusion does not help least squares.",
        "figures 1 to 4, no numbers",
        (
            *(ratio(name, RLS_F, RLS1, between(0.93, 1.07)) for name in CASES),
            *(ratio(name, RLS_F, RLS2, between(0.93, 1.07)) for name in CASES),
            *(ratio(name, MEAN_RLS, RLS1, above(0.93)) for name in CASES),
        ),
        {
            "partly": "That holds for stacked rows. Averaging the sensors first halves the noise of the regressors, and nearly "
            "halves the bias of least squares."
        },
    ),
    Claim(
        "TLS over LS (3)",
        "All total least squares methods are clearly better than least squares.",
        "figures 1 to 4, no numbers",
        (
            *(ratio(name, RTLS1, RLS1, below(0.5)) for name in CASES),
            *(ratio(name, RTLS_F, RLS_F, below(0.5)) for name in CASES),
        ),
        {"reproduced": "Where all columns have equal and independent noise; see below for noise as it is."},
    ),
    Claim(
        "line searches (4)",
        "RTLS of one sensor is slightly better than FRTLS.",
        "figures 1 to 4, no numbers",
        (
            *(nearer(name, RTLS1, (COLD,), above(0.5), quantity="error_200") for name in CASES),
            *(nearer(name, RTLS1, (FRTLS,), above(0.5), quantity="error_200") for name in CASES),
            *(ratio(name, RTLS1, FRTLS, below(0.95)) for name in CASES),
        ),
        {
            "partly": "It is ahead, at first, of line searches that start from nothing. Those that start from least squares "
            "are ahead of it as long as the bias is small beside the scatter; in the end all are the same."
        },
    ),
    Claim(
        "searches from nothing",
        "FRTLS needs no other estimate to start from.",
        "not in the paper, which does not say how it starts",
        tuple(_lost(name) for name in CASES),
        {
            "not reproduced": "From nothing the first searches run off to infinity in some records, and steps along the newest "
            "row do not bring them back."
        },
    ),
    Claim(
        "fusion (6)",
        "The error of the fused total least squares is clearly below that of either sensor alone.",
        "figures 1 to 4, no numbers",
        tuple(_singles(name) for name in CASES),
        {"reproduced": "On average, by the square root of two that twice the rows give."},
    ),
    Claim(
        "fusion, every record",
        "It is so in any one record, such as the paper shows.",
        "not in the paper",
        tuple(nearer(name, RTLS_F, (RTLS1, RTLS2), above(0.5)) for name in CASES),
        {
            "not reproduced": "The fused estimate lies between those of the sensors, one of which is nearer by luck in most "
            "records."
        },
    ),
    Claim(
        "a fair alternative",
        "Stacking the sensors' rows is the best use of both.",
        "not in the paper, which knows no other",
        tuple(ratio(name, MEAN_RTLS, RTLS_F, above(0.98)) for name in CASES),
        {"not reproduced": "Total least squares of the sensors' mean is more accurate by a tenth to a fifth."},
    ),
    Claim(
        "noise unknown",
        "One sensor as the instrument of the other is about as accurate as the fusion, and knows nothing of the noise but that "
        "the sensors' is independent.",
        "not in the paper",
        tuple(ratio(name, CROSS, RTLS_F, below(1.2)) for name in CASES),
    ),
)


def chapter() -> Chapter:
    """Four experiments, seven contenders of the paper and four more."""
    experiments = tuple(
        judged(
            name,
            f"{axis.name.capitalize()}, variance {variance:g}",
            axis,
            noisy_rows(axis, (variance, variance)),
            everybody(),
            baseline=MEAN_RLS,
            kept=("error", "theta") if name == FIRST else ("error",),
        )
        for name, (axis, variance) in CASES.items()
    )
    return Chapter(
        experiments,
        CLAIMS,
        tables,
        figures,
        (
            "The vehicle's parameters, those of a planar benchmark (Repoulias and Papadopoulos 2007), and the excitation are "
            "chosen here, the paper's being in a thesis that is not at hand. Noise is read as Gaussian, independent, and of "
            "the stated variance in each of the four columns of each sensor, sample by sample: the reading under which its "
            "theory holds.",
            "FRTLS starts from the least squares of its first 100 rows, unless said otherwise; all others start from nothing, "
            "least squares with a standard deviation of 1000.",
        ),
    )
