"""Two sensors of which one is much better: what weights do for stacked rows, and what they do for the mean."""

from __future__ import annotations

from ..chapter import Chapter
from ..claims import Claim, below
from ..figures import Chart, Table
from ..outcome import Outcome
from .comparing import ratio
from .contenders import RLS_F, RTLS1, RTLS2, RTLS_F, alone, averaged, least_squares, stacked, total_least_squares
from .measures import judged
from .records import YAW, noisy_rows

NAME = "unequal"
VARIANCES = (0.1, 0.4)
WEIGHTS = (1.0 / VARIANCES[0], 1.0 / VARIANCES[1])
BEST, OTHER = f"{RTLS1}, the better sensor", f"{RTLS2}, the worse sensor"
ALIKE, WEIGHTED = f"{RTLS_F}, equal weights", f"{RTLS_F}, weighted"
MEAN, MEAN_RLS, STACKED_RLS = "RTLS, weighted mean", "RLS, weighted mean", f"{RLS_F}, equal weights"


def tables(outcome: Outcome) -> list[Table]:
    """Errors after some samples and at the end."""
    return [
        outcome.table(
            NAME,
            ("error_200", "error_500", "error", "m", "d", "d2"),
            title="Unequal sensors, variances 0.1 and 0.4: relative errors, and biases after 2000 samples",
        )
    ]


def figures(outcome: Outcome) -> list[Chart]:
    """Errors at the end."""
    chosen = (BEST, OTHER, ALIKE, WEIGHTED, MEAN, MEAN_RLS)
    return [
        Chart(
            "Unequal sensors",
            "Relative error after 2000 samples, yaw, variances 0.1 and 0.4. Weights inverse to the variances are right for the "
            "mean of the sensors; stacked rows gain nothing by the worse sensor.",
            "relative error",
            {name: outcome.mean(NAME, name, "error") for name in chosen},
        )
    ]


CLAIMS = (
    Claim(
        "unequal, stacked",
        "Stacked with weights inverse to their variances, two sensors are more accurate than the better one alone.",
        "not in the paper, whose sensors are equal",
        (ratio(NAME, WEIGHTED, BEST, below(0.97)),),
        {
            "not reproduced": "Noise of the regressors scatters the estimate by itself, too. Stacked, the worse sensor's rows "
            "bring as much of that as they tell; in the mean they do not."
        },
    ),
    Claim(
        "unequal, weighted mean",
        "Their weighted mean is.",
        "not in the paper",
        (ratio(NAME, MEAN, BEST, below(0.97)), ratio(NAME, MEAN, WEIGHTED, below(0.97))),
    ),
    Claim(
        "unequal, no weights",
        "Without weights the fusion is worse than the better sensor alone.",
        "not in the paper",
        (ratio(NAME, BEST, ALIKE, below(0.8)),),
    ),
)


def chapter() -> Chapter:
    """One experiment, not in the paper."""
    contenders = {
        BEST: alone(total_least_squares(), 0),
        OTHER: alone(total_least_squares(), 1),
        ALIKE: stacked(total_least_squares()),
        WEIGHTED: stacked(total_least_squares(WEIGHTS)),
        MEAN: averaged(total_least_squares(), WEIGHTS),
        STACKED_RLS: stacked(least_squares()),
        MEAN_RLS: averaged(least_squares(), WEIGHTS),
    }
    experiment = judged(
        NAME, "Yaw, variances 0.1 and 0.4", YAW, noisy_rows(YAW, VARIANCES), contenders, baseline=MEAN_RLS
    )
    return Chapter((experiment,), CLAIMS, tables, figures)
