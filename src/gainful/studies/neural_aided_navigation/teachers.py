"""Who teaches the network: truth, a precise receiver, or the same records smoothed."""

from __future__ import annotations

import functools

from ...plants import TRACK_SCENARIOS
from ..chapter import Chapter
from ..claims import Claim, below
from ..figures import Table
from ..outcome import Outcome
from ..prepared import Prepared
from .aiding import aided, filtered
from .comparing import errors_beside, ratio, ratios
from .contenders import CMAC, DESIGN, ML
from .measures import judged
from .noise import design, fitted
from .records import Drive
from .same_record import NEW, SAME, same_record_experiment

NAME, SCENARIO = "teachers", "calibrated"
REFERENCE, SMOOTHER, SELF = "CMAC, reference", "CMAC, smoother", "CMAC, smoother of the design"
TOLD = {
    DESIGN: (0.0302, 0.0294),
    ML: (0.0065, 0.0075),
    CMAC: (0.0071, 0.0147),
    REFERENCE: (0.0070, 0.0155),
    SMOOTHER: (0.0069, 0.0155),
    SELF: (0.0079, 0.0177),
}
"""Of an independent program."""
TOLD_SAME = {
    f"{DESIGN}, on the record taught with": (0.0267, 0.0220),
    SAME: (0.0063, 0.0110),
    f"{DESIGN}, on a new record": (0.0306, 0.0307),
    NEW: (0.0075, 0.0199),
}
"""Likewise, the mean of ten training records."""


def tables(outcome: Outcome) -> list[Table]:
    """Teachers, and one record."""
    return [
        errors_beside(outcome, "A CMAC of 10 layers and its teachers", NAME, tuple(TOLD), TOLD),
        errors_beside(
            outcome,
            "A CMAC of 10 layers taught with one record, on that record and on a new one",
            "one record",
            tuple(TOLD_SAME),
            TOLD_SAME,
        ),
    ]


CLAIMS = (
    Claim(
        "no truth needed",
        "A smoother of the same records, its noise fitted to them, teaches nearly as well as truth.",
        "not in the paper",
        # An independent program's smoother taught 5 % worse than truth; trainings differ by 2 %, two of them by 3 %.
        ratios("speed", NAME, (SMOOTHER, REFERENCE, SELF), CMAC, below(1.1)),
        {"partly": "Not the smoother of the design filter, which passes its own errors on."},
    ),
    Claim(
        "its own record",
        "A network judged on the record it was taught with is no better there than on others.",
        "the paper does not say on which record it judges",
        # No better: within a tenth.
        (ratio("speed", "one record", NEW, SAME, below(1.1)),),
    ),
)


def chapter() -> Chapter:
    """Two experiments."""
    makers = {
        DESIGN: lambda: filtered(design()),
        ML: lambda: filtered(fitted(SCENARIO)),
        **{name: functools.partial(aided, name, SCENARIO) for name in (CMAC, REFERENCE, SMOOTHER, SELF)},
    }
    experiment = judged(NAME, "Teachers of the CMAC", Drive(TRACK_SCENARIOS[SCENARIO]), Prepared(makers), baseline=ML)
    return Chapter((experiment, same_record_experiment()), CLAIMS, tables)
