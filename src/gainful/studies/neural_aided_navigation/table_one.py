"""The paper's Table 1 and Fig. 4: convergence and precision, with the tuned filter beside."""

from __future__ import annotations

import functools

import numpy as np

from ...diagnostics import innovation_lag_bound, stationary_mistuned_error
from ...linalg import stationary_gain
from ...plants import TRACK_SCENARIOS
from ...plants.track import FIX_SIGMA, POSITION_SIGMA, SPEED_SIGMA, STEP
from ..chapter import Chapter
from ..claims import Check, Claim, Tolerance, above, below, near
from ..figures import Figure, Line, Panel, Table
from ..outcome import Outcome
from ..prepared import Prepared
from .comparing import errors_beside, mean, ratio, ratios
from .contenders import (
    ADAPTIVE,
    CMAC,
    DESIGN,
    DESIGN_WIDE,
    ML,
    ML_CMAC,
    ML_CMACS,
    ML_MLP,
    PAPER,
    RECOMMENDED,
    SAGE_HUSA,
    TRUE,
    TRUTH_TUNED,
    VB_R,
    common,
    published,
)
from .measures import judged
from .records import Drive
from .settling import COMMON_BAND, RULES, settling, settling_difference

NAME = "calibrated"
COARSE = ("CMAC, 10 levels", "CMAC, 10 cells")
BP = ("BP, SGD", "BP, L-BFGS")
SHOWN = (DESIGN, BP[0], CMAC, ML)
PRINTED = {DESIGN: (0.0309, 0.0315), BP[0]: (0.0185, 0.0253), CMAC: (0.0101, 0.0122)}
"""The paper's variances [m^2, m^2/s^2]; which perceptron and which table it had is not said."""
PRINTED_TIMES = {DESIGN: (820.0, 920.0), BP[0]: (700.0, 810.0), CMAC: (610.0, 600.0)}
"""And its convergence times [s]."""
TOLD = {
    DESIGN: (0.0302, 0.0294),
    DESIGN_WIDE: (0.0302, 0.0294),
    "BP, SGD": (0.0066, 0.0206),
    "BP, L-BFGS": (0.0065, 0.0155),
    "CMAC, 10 levels": (0.0164, 0.0233),
    "CMAC, 10 cells": (0.0201, 0.0286),
    CMAC: (0.0071, 0.0147),
    "CMAC, compressed": (0.0067, 0.0146),
    "affine map": (0.0065, 0.0189),
    "CMAC, leaky innovation": (0.0067, 0.0083),
    "CMAC, fed back": (0.0067, 0.0078),
    ML: (0.0065, 0.0075),
    TRUE: (0.0065, 0.0075),
    ML_CMAC: (0.0067, 0.0079),
    ML_MLP: (0.0066, 0.0077),
    VB_R: (0.0065, 0.0075),
    "VB-PR": (0.0097, 0.0075),
    "strong tracking": (0.0103, 0.0092),
    "IMM": (0.0071, 0.0078),
    SAGE_HUSA: (0.0319, 0.0076),
    "innovation matching": (0.0621, 0.0076),
    "Huber": (0.0379, 0.0076),
}
"""Mean square errors of an independent program, 200 other runs."""
TOLD_TIMES = {
    DESIGN: (890.0, 940.0),
    DESIGN_WIDE: (10.0, 20.0),
    "BP, SGD": (130.0, 100.0),
    "BP, L-BFGS": (10.0, 20.0),
    "CMAC, 10 levels": (780.0, 810.0),
    "CMAC, 10 cells": (700.0, 740.0),
    CMAC: (20.0, 20.0),
    "CMAC, compressed": (70.0, 120.0),
    "affine map": (10.0, 20.0),
    "CMAC, leaky innovation": (70.0, 140.0),
    "CMAC, fed back": (20.0, 20.0),
    ML: (10.0, 30.0),
    TRUE: (10.0, 30.0),
    ML_CMAC: (10.0, 20.0),
}
"""Times after which errors settle, likewise [s]."""
ROWS = (DESIGN, DESIGN_WIDE, *PAPER, RECOMMENDED, ML, ML_CMAC, ML_CMACS, ML_MLP, *ADAPTIVE, TRUTH_TUNED, TRUE)
TIMED = (DESIGN, DESIGN_WIDE, *PAPER, ML, ML_CMAC, ML_MLP, TRUE)

WORDS = ("displacement", "speed")
HALF = 0.5
"""Share by which a time of the paper may be missed: its words (200 s) and its table (320 s) differ by more than that."""
DOUBTED = 0.05
"""Share of an error by which two trainings may differ: ten sets of forty records gave networks 2 % apart (one sigma)."""
NEES = near(1.0, relative=0.17)


@functools.cache
def bounds() -> dict[str, tuple[float, float]]:
    """What theory says of corrections of the design filter: mean square errors of displacement and speed."""
    F, H = np.array([[1.0, STEP], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    believed = np.diag([POSITION_SIGMA**2, SPEED_SIGMA**2]), np.array([[FIX_SIGMA**2]])
    truth = TRACK_SCENARIOS[NAME]
    true = (
        np.diag([float(truth.position_sigma) ** 2, float(truth.speed_sigma) ** 2]),
        np.array([[float(truth.fix_sigma) ** 2]]),
    )
    gain = stationary_gain(F, H, *believed)
    assert gain is not None
    found = stationary_mistuned_error(F, H, gain, *true)

    def pair(cov: np.ndarray) -> tuple[float, float]:
        return float(cov[0, 0]), float(cov[1, 1])

    return {
        "the design filter": pair(found.cov),
        "corrected by the best line of the innovation": pair(found.corrected),
        **{
            f"by the best line of the last {lags} innovations": pair(innovation_lag_bound(F, H, gain, *true, lags=lags))
            for lags in (2, 5, 12, 60)
        },
    }


def tables(outcome: Outcome) -> list[Table]:
    """Precision, times, and the limits of a correction."""
    times = [
        Table(
            f"Time after which the root mean square error of the {state} over all runs stays within its band [s]: 1.5 times "
            f"its own steady value for 200 s (settles), the same for ever (last exit), {COMMON_BAND:g} {unit} (common band)",
            ("filter", *RULES, "independent program, settles", "paper"),
            tuple(
                (
                    name,
                    *(settling(outcome, NAME, name, k, rule) for rule in RULES),
                    TOLD_TIMES.get(name, (None, None))[k],
                    PRINTED_TIMES.get(name, (None, None))[k],
                )
                for name in TIMED
            ),
        )
        for k, (state, unit) in enumerate(zip(WORDS, ("m", "m/s"), strict=True))
    ]
    limits = Table(
        "What a correction of the design filter can come to, by theory",
        ("filter", "displacement, MSE [m^2]", "speed, MSE [m^2/s^2]"),
        tuple((name, *(f"{each:.4g}" for each in both)) for name, both in bounds().items()),
    )
    title = "Table 1 of the paper: precision over the second half of the record"
    return [errors_beside(outcome, title, NAME, ROWS, TOLD, paper=PRINTED), *times, limits]


def figures(outcome: Outcome) -> list[Figure]:
    """Fig. 4 of the paper: one run, and the root mean square over all."""
    t = np.asarray(outcome.record(NAME).truth["t"])

    def lines(state: int, *, first: bool) -> tuple[Line, ...]:
        out = []
        for name in SHOWN:
            error = outcome.every(NAME, name, "error")[:, :, state]
            out.append(Line(name, t, error[0] if first else np.sqrt((error**2).mean(axis=0))))
        return tuple(out)

    title = "Fig. 4 of the paper: errors against time"
    return [
        Figure(
            title,
            "One run: the start is wrong by 5 m and 5 m/s, and the design filter trusts its speed.",
            (
                Panel("error of displacement", lines(0, first=True), "m"),
                Panel("error of speed", lines(1, first=True), "m/s"),
            ),
        ),
        Figure(
            title,
            "Root mean square over all runs. The filter fitted to the records by their likelihood knows no truth.",
            (
                Panel("error of displacement", lines(0, first=False), "m", log=True),
                Panel("error of speed", lines(1, first=False), "m/s", log=True),
            ),
        ),
    ]


def _sooner(contender: str, state: int, expected: Tolerance) -> Check:
    return Check(
        f"{WORDS[state]}, settles, {DESIGN} less {contender} [s]",
        lambda outcome: settling_difference(outcome, NAME, DESIGN, contender, state),
        expected,
    )


def _printed_gain(state: int) -> float:
    """By how much the paper's CMAC settles sooner than its filter [s]."""
    return PRINTED_TIMES[DESIGN][state] - PRINTED_TIMES[CMAC][state]


CLAIMS = (
    Claim(
        "convergence (C1)",
        "The CMAC shortens convergence by nearly 200 s.",
        "820 to 610 s in displacement, 920 to 600 s in speed",
        (
            # Any of the three readings of "ten" may be the paper's network.
            *(_sooner(name, state, above(0.0)) for name in (*COARSE, CMAC) for state in (0, 1)),
            *(
                _sooner(name, state, near(_printed_gain(state), relative=HALF))
                for name in (*COARSE, CMAC)
                for state in (0, 1)
            ),
            Check(
                "displacement, settles, the same filter from a wide start [s]",
                lambda outcome: settling(outcome, NAME, DESIGN_WIDE, 0),
                near(PRINTED_TIMES[DESIGN][0], relative=HALF),
            ),
        ),
        {
            "partly": "A coarse table gains some 100 s, a sensible one far more; but the filter is slow only because it is "
            "told that its start is good. With an honest covariance of the start it settles in 20 s and needs no network.",
        },
    ),
    Claim(
        "precision (C2)",
        "The CMAC makes the filter twice as precise.",
        "variances 3.06 and 2.58 times smaller in displacement and speed",
        (
            ratio("displacement", NAME, DESIGN, CMAC, above(2.0)),
            ratio("speed", NAME, DESIGN, CMAC, above(2.0)),
            ratio("displacement", NAME, ML, CMAC, above(1.0)),
            ratio("speed", NAME, ML, CMAC, above(1.0)),
            ratio("speed", NAME, CMAC, DESIGN, near(PRINTED[CMAC][1] / PRINTED[DESIGN][1], relative=DOUBTED)),
        ),
        {
            "partly": "Against the design filter, not against the same filter with noise fitted to the records, which needs no "
            "truth. The paper's ratio in speed is below what any function of the present innovation reaches here."
        },
    ),
    Claim(
        "beats BP (C3)",
        "The CMAC is more precise than a perceptron trained by back-propagation (BP).",
        "0.0101 against 0.0185 m^2, 0.0122 against 0.0253 m^2/s^2",
        tuple(
            ratio(state, NAME, name, each, below(1.0))
            for name in (CMAC, COARSE[0])
            for each in BP
            for state in ("displacement", "speed")
        ),
        {
            "partly": "A table of ten levels loses in both; a fine one is about as good as a perceptron, whose training "
            "ends now here, now there."
        },
    ),
    Claim(
        "fed back",
        "Fed back, the correction comes close to the tuned filter; open loop it cannot.",
        "not in the paper, whose correction is an output as far as it can be read",
        # An independent program's came to 1.04 and, with a memory, to 1.11 times the tuned filter's error.
        ratios("speed", NAME, ("CMAC, fed back", CMAC, "CMAC, leaky innovation"), ML, below(1.11 + DOUBTED)),
        {
            "partly": "It takes a memory of innovations, or feedback, whose training is a matter of luck: three orders of the "
            "same records gave 0.0076, 0.0081 and 0.0092 m^2/s^2, here the last."
        },
    ),
    Claim(
        "beside tuned noise",
        "Beside a filter with the right noise a network gains nothing.",
        "not in the paper",
        (
            ratio("displacement", NAME, ML_CMAC, ML, above(1.0)),
            ratio("speed", NAME, ML_CMAC, ML, above(1.0)),
            # What the likelihood of 400 records comes to, in an independent program.
            ratio("speed", NAME, ML, TRUE, below(1.03)),
        ),
    ),
    Claim(
        "its own covariance",
        "The covariance found on the records kept apart tells the errors of the corrected estimate.",
        "not in the paper, which reports none",
        # Squares of the speed's error are correlated over some 28 rows, so that the 30 records tell its variance to
        # sqrt(2 * 28 / 4500) = 11 %, and the mean of both states to 6 %; three times that.
        (
            mean("NEES over 2 where corrected, CMAC with both gates", NAME, RECOMMENDED, "nees_corrected", NEES),
            mean("NEES over 2, KF, design", NAME, DESIGN, "nees", NEES),
        ),
        {"partly": "The design filter's own covariance is wrong by a factor of twenty."},
    ),
)


def chapter() -> Chapter:
    """The paper's experiment."""
    experiment = judged(
        NAME,
        "Noise of other sizes than the design's",
        Drive(TRACK_SCENARIOS[NAME]),
        Prepared({**common(NAME), **published()}),
        baseline=ML,
        kept=("error",),
    )
    return Chapter((experiment,), CLAIMS, tables, figures)
