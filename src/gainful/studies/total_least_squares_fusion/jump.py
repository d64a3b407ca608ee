"""An inertia that jumps, and how fast to forget."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ...filters import Info
from ..chapter import Chapter
from ..claims import Check, Claim, above, below
from ..experiment import Experiment, Quantity, Record
from ..figures import Band, Figure, Line, Panel, Table
from ..outcome import Outcome
from .comparing import rms_ratio
from .contenders import RLS_F, RTLS_F, least_squares, stacked, total_least_squares
from .figures import middle
from .measures import Traces
from .records import STEP, YAW, NoisyRows, motion

NAME = "jump"
SAMPLES, ONSET = 4000, 2000
SIZE, VARIANCE = 0.3, 0.1
FORGETTING = (1.0, 0.998, 0.995, 0.99)
AT = (1999, 2200, 2500, 3000, 3999)
"""Rows at which errors of the inertia are told."""
MOST = 50
ROWS = np.arange(9, SAMPLES, 10)
BEGIN = 20
"""Of those, from which the figure begins."""
BANDED = 0.995
"""Forgetting of which the runs' spread is drawn."""


def with_forgetting(name: str, factor: float) -> str:
    """A contender's name."""
    return f"{name}, forgetting {factor:g}"


QUANTITIES = tuple(Quantity(f"row_{row}", f"row {row}", YAW.units[0], "rms") for row in AT)


class Measure(eqx.Module):
    """From a record and the reports along it to errors of the inertia."""

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        off = info.estimate.mean[:, 0] - record.truth["theta"][:, 0]
        return {f"row_{row}": off[row] for row in AT}


def records() -> NoisyRows:
    """Records of yaw whose inertia jumps."""
    theta = jnp.tile(jnp.asarray(YAW.theta), (SAMPLES, 1))
    theta = theta.at[ONSET:, 0].multiply(1.0 + SIZE)
    return NoisyRows(motion(SAMPLES), theta, jnp.sqrt(jnp.full(2, VARIANCE)))


def experiment() -> Experiment:
    """Both recursions with several forgetting factors."""
    contenders = {
        with_forgetting(name, factor): stacked(make(forgetting=factor))
        for name, make in ((RTLS_F, total_least_squares), (RLS_F, least_squares))
        for factor in FORGETTING
    }
    return Experiment(
        NAME,
        "Jump of the inertia",
        records(),
        contenders,
        Measure(),
        QUANTITIES,
        Traces(jnp.asarray(ROWS)),
        most_runs=MOST,
        kept=("theta",),
    )


def tables(outcome: Outcome) -> list[Table]:
    """Errors before and after the jump."""
    return [outcome.table(NAME, title="Inertia that jumps by 30 % at row 2000: error of m, root mean square over runs")]


def figures(outcome: Outcome) -> list[Figure]:
    """The inertia over time."""
    t = STEP * (ROWS + 1.0)
    truth = np.asarray(outcome.record(NAME).truth["theta"])[ROWS, 0]
    rows = slice(BEGIN, None)

    def panel(name: str) -> Panel:
        marks: list[Band | Line] = []
        for factor in FORGETTING:
            values = outcome.every(NAME, with_forgetting(name, factor), "theta")[:, rows, 0]
            marks += middle(f"forgetting {factor:g}", t[rows], values, band=factor == BANDED)
        reference = Line("truth", t[rows], truth[rows], reference=True)
        return Panel(f"m by {name}, median of the runs", (*marks, reference), YAW.units[0])

    return [
        Figure(
            "A jump of the inertia",
            "Yaw, variance 0.1, the inertia jumps by 30 %, as by a load taken up. A factor of 0.995 is a memory of 10 s. "
            "Least squares forgets as fast, but follows a biased value.",
            (panel(RTLS_F), panel(RLS_F)),
        )
    ]


def _over(row: int, factor: float, under: float) -> Check:
    names = with_forgetting(RTLS_F, factor), with_forgetting(RTLS_F, under)
    return Check(
        f"root mean square error of m at row {row}, {names[0]} over {names[1]}",
        lambda outcome: rms_ratio(outcome, NAME, f"row_{row}", *names),
        below(1.0),
    )


CLAIMS = (
    Claim(
        "following a jump",
        "Forgetting lets total least squares follow a parameter that jumps.",
        "not in the paper",
        (
            _over(2500, 0.995, 1.0),
            _over(3000, 0.995, 1.0),
            _over(3999, 0.998, 1.0),
            Check(
                "root mean square error of m 1000 samples after the jump, forgetting 0.995 [kg m^2]",
                lambda outcome: outcome.rms(NAME, with_forgetting(RTLS_F, 0.995), "row_3000"),
                below(4.0),
            ),
        ),
    ),
    Claim(
        "forgetting is free",
        "It costs nothing while nothing changes.",
        "not in the paper",
        tuple(_over(1999, factor, 1.0) for factor in FORGETTING[1:]),
        {"not reproduced": "A shorter memory holds fewer rows: the error before the jump rises up to fourfold."},
    ),
    Claim(
        "forgetting and bias",
        "However fast it forgets, least squares stays off.",
        "not in the paper",
        tuple(
            Check(
                f"root mean square error of m at row 3999, {with_forgetting(RLS_F, factor)} [kg m^2]",
                lambda outcome, factor=factor: outcome.rms(NAME, with_forgetting(RLS_F, factor), "row_3999"),
                above(7.0),
            )
            for factor in FORGETTING
        ),
    ),
)


def chapter() -> Chapter:
    """One experiment, not in the paper."""
    return Chapter((experiment(),), CLAIMS, tables, figures)
