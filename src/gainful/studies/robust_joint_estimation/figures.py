"""Tables and figures that several chapters show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ...plants.hydraulic_servo_reduced import MEASUREMENT_SIGMAS
from ..experiment import Record
from ..figures import Figure, Line, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured

PARAMETERS = ("p1, viscous friction over nominal", "p2, bulk modulus over nominal")
"""Labels of their panels."""
OVER = 20
"""Samples over which curves of squared errors are averaged, that they can be told apart."""


def compared(
    outcome: Outcome, title: str, names: Sequence[str], columns: Sequence[tuple[str, str, str]], *, of: str = "filter"
) -> Table:
    """A table of contenders.

    Args:
        outcome: of the study.
        title: what it shows.
        names: of the contenders.
        columns: heading, experiment and quantity of each.
        of: what the rows are.
    """
    rows = tuple((name, *(_cell(outcome, where, name, what) for _, where, what in columns)) for name in names)
    return Table(title, (of, *(head for head, _, _ in columns)), rows)


def _cell(outcome: Outcome, experiment: str, contender: str, quantity: str) -> Measured | None:
    """A number, or nothing where it has no meaning for the contender."""
    if np.isnan(outcome.values(experiment, contender, quantity)).all():
        return None
    return outcome.summary(experiment, contender, quantity)


def errors_over_time(outcome: Outcome, experiment: str, title: str, names: Sequence[str]) -> Figure:
    """Mean over runs of the squared errors, on a logarithmic axis."""
    t = _averaged(outcome.record(experiment).truth["t"])

    def lines(what: str) -> tuple[Line, ...]:
        return tuple(Line(name, t, _averaged(outcome.trace(experiment, name, what).mean)) for name in names)

    return Figure(
        title,
        "Squared errors, mean over runs and over 20 ms: of the states in sigmas of the sensors, mean over the three; of the "
        "parameters, sum over the two. The paper plots their logarithm; the axis here is logarithmic.",
        (Panel("states", lines("x"), log=True), Panel("parameters", lines("p"), log=True)),
    )


def outliers(record: Record, sensor: int, rows: slice) -> Line:
    """Readings that are gross errors as single points, those within the range of the truth and ten sigmas around."""
    t, y = record.truth["t"][rows], np.asarray(record.samples.y)[rows, sensor]
    truth, sigma = record.truth["states"][rows, sensor], MEASUREMENT_SIGMAS[sensor]
    gross = record.truth["variance"][rows, sensor] > 1.5 * sigma**2
    near = (y > truth.min() - 10.0 * sigma) & (y < truth.max() + 10.0 * sigma)
    chosen = np.flatnonzero(gross & near)
    # Points with gaps between them are not joined.
    x = np.stack([t[chosen], t[chosen]], axis=1).ravel()
    return Line("gross errors", x, np.stack([y[chosen], np.full(len(chosen), np.nan)], axis=1).ravel())


def _averaged(values: Float[np.ndarray, "T"]) -> Float[np.ndarray, "rows"]:
    values = np.asarray(values)
    return values[: len(values) // OVER * OVER].reshape(-1, OVER).mean(axis=1)
